// Which sampler draws the random numbers, as specialisation constants: the others leave the pipeline.
// Host twin: renderer/src/sampling.rs. The ids stand apart from those of shared/needs.glsl.
#ifndef SHARED_SAMPLER
#define SHARED_SAMPLER

// In the order of renderer::Sampler.
const uint SAMPLER_SOBOL = 0u;
const uint SAMPLER_HALTON = 1u;
const uint SAMPLER_HAMMERSLEY = 2u;
const uint SAMPLER_INDEPENDENT = 3u;
const uint SAMPLER_BLUE_NOISE = 4u;

layout(constant_id = 32) const uint SAMPLER = 0u;               // SAMPLER_*
layout(constant_id = 33) const uint HAMMERSLEY_SIZE = 256u;     // points of one Hammersley set, 1..2^24; each stream draws sets of its own

#endif
