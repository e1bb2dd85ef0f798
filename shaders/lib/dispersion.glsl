// Index of refraction by colour (KHR_materials_dispersion: 20 / Abbe number). A path through dispersive glass carries one channel, drawn
// evenly, from the first such surface on ("hero" channel: Wilkie et al., "Hero Wavelength Spectral Sampling", 2014, with one wavelength).
#ifndef LIB_DISPERSION
#define LIB_DISPERSION

const uint DISPERSION_NO_CHANNEL = 3u;  // all of them: nothing dispersive so far

// Index of channel 0 (red), 1 or 2; the middle one for all others. Half of nF - nC = (n - 1) / V lies on either side of green.
float dispersion_ior(float ior, float dispersion, uint channel) {
    float half_spread = (ior - 1.0) * 0.025 * dispersion;
    float side = channel == 0u ? -1.0 : (channel == 2u ? 1.0 : 0.0);
    return max(ior + side * half_spread, 1.0);
}

uint dispersion_channel(float xi) {
    return min(uint(xi * 3.0), 2u);
}

// What the throughput is multiplied with when a path becomes one of a single channel: the mean over the channels is 1.
vec3 dispersion_weight(uint channel) {
    return vec3(channel == 0u ? 3.0 : 0.0, channel == 1u ? 3.0 : 0.0, channel == 2u ? 3.0 : 0.0);
}

#endif
