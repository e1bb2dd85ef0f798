//! Rows 5 and 12: the accumulator over 65,536 samples, its fold, and samples that are not finite.
//! The naive forms: running averages in 8 bits, 16 bits and single precision.

use caustica_gpu::{
    Access, Bind, Buffer, BufferUse, ComputePipeline, Format, Image, ImageDesc, ImageUse, Location,
    MemoryUse, ShaderModule, Specialization, Stage, Use,
};
use caustica_renderer::BLOCK_SAMPLES;
use caustica_renderer::gpu_types::{AccumulatorPixel, Frame, Push};
use caustica_renderer::shader::{ShaderSources, SpirvCache, compile, reflect};
use caustica_tests::compute::{Snippet, run, shader_text};
use caustica_tests::gpu::{Session, session};
use caustica_tests::numbers::Random;
use caustica_tests::shaders_under_test;

const SAMPLES: usize = 65_536;

/// `fold` and `add_sample` as the pass has them.
fn functions_of_the_pass() -> String {
    let text = shader_text("passes/accumulate/accumulate.comp");
    let start = text.find("void fold(").expect("the function fold");
    let end = text.find("void main(").expect("the function main");
    text[start..end].to_owned()
}

#[test]
fn the_mean_of_65536_samples_is_exact_to_a_millionth() {
    let mut session = session();
    let functions = format!(
        "{}
        // A radiance between 0 and 2000 with rare peaks, as a firefly has them; a function of integers alone.
        float sample_value(uint pixel, uint i) {{
            uint h = hash_pcg4d(uvec4(pixel, i, 0u, 0u)).x;
            return (h & 1023u) == 0u ? 2000.0 * unit_float(h) : unit_float(h);
        }}",
        functions_of_the_pass()
    );
    let body = "
        StreamSum streams[2];
        for (uint s = 0u; s < 2u; ++s) {
            streams[s] = StreamSum(vec4(0.0), vec4(0.0), vec4(0.0));
        }
        Frame frame;
        float running = 0.0, plain = 0.0, half_mean = 0.0, byte_mean = 0.0, byte_early = 0.0, half_early = 0.0;
        for (uint i = 0u; i < 65536u; ++i) {
            float x = sample_value(index, i);
            uint within = (i >> 1u) % 32u;
            frame.block_start = within == 0u ? 1u : 0u;
            frame.block_end = within == 31u ? 1u : 0u;
            streams[i & 1u] = add_sample(streams[i & 1u], vec4(vec3(x), 1.0), frame);
            plain += x;
            running = mix(running, x, 1.0 / float(i + 1u));
            float y = 0.5 + 0.25 * unit_float(hash_pcg4d(uvec4(index, i, 1u, 0u)).x) * (i < 8192u ? 1.0 : 2.0);
            // Half floats between 0.5 and 1 are multiples of 2^-11.
            half_mean = round(2048.0 * mix(half_mean, y, 1.0 / float(i + 1u))) / 2048.0;
            byte_mean = round(255.0 * mix(byte_mean, y, 1.0 / float(i + 1u))) / 255.0;
            if (i == 8191u) {
                byte_early = byte_mean;
                half_early = half_mean;
            }
        }
        for (uint s = 0u; s < 2u; ++s) {
            write(s * 3u, streams[s].high.x); write(s * 3u + 1u, streams[s].low.x); write(s * 3u + 2u, streams[s].block.x);
            write(6u + s, streams[s].high.w + streams[s].block.w);
        }
        write(8u, plain); write(9u, running); write(10u, half_mean - half_early); write(11u, byte_mean - byte_early);";
    assert_eq!(BLOCK_SAMPLES, 32, "the snippet has the block length of the host");
    let values = run(
        &mut session,
        &Snippet {
            includes: &["shared/frame.glsl", "lib/random.glsl"],
            functions: &functions,
            body,
            values: 12,
            count: 64,
            ..Snippet::default()
        },
    );
    let (mut ours, mut plain, mut running) = (0.0_f64, 0.0_f64, 0.0_f64);
    for (pixel, row) in values.chunks_exact(12).enumerate() {
        let exact: f64 = (0..SAMPLES as u32).map(|i| f64::from(sample_value(pixel as u32, i))).sum();
        let at = |i: usize| f64::from(row[i]);
        let sum: f64 = (0..6).map(at).sum();
        assert_eq!((row[6], row[7]), (32_768.0, 32_768.0));
        let error = |value: f64| (value / exact - 1.0).abs();
        ours = ours.max(error(sum));
        plain = plain.max(error(at(8)));
        running = running.max(error(at(9) * SAMPLES as f64));
        // The samples from the 8192nd on are brighter by 0.125 in the mean: an average that still moves shows it.
        assert!(at(11).abs() < 1e-6, "the 8-bit average is expected to stall: it moved by {}", at(11));
        assert!(at(10).abs() < 1e-6, "the 16-bit average is expected to stall: it moved by {}", at(10));
    }
    assert!(ours < 1e-6, "{ours}");
    assert!(
        plain > 4.0 * ours && running > 4.0 * ours,
        "ours {ours}, plain sum {plain}, running mean {running}"
    );
}

#[test]
fn the_fold_loses_nothing_beside_a_large_sum() {
    // A million samples of 0.1 beside 1e8, where floats are 8 apart: the plain sum does not move at all.
    let functions = functions_of_the_pass();
    let body = "
        vec4 high = vec4(1e8), low = vec4(0.0);
        float plain = 1e8;
        for (uint i = 0u; i < 1000000u; ++i) {
            fold(high, low, vec4(0.1));
            plain += 0.1;
        }
        write(0u, high.x); write(1u, low.x); write(2u, plain);";
    let mut session = session();
    let values = run(
        &mut session,
        &Snippet {
            includes: &["shared/frame.glsl"],
            functions: &functions,
            body,
            values: 3,
            count: 1,
            ..Snippet::default()
        },
    );
    let exact = 1e8 + 1e6 * f64::from(0.1_f32);
    let sum = f64::from(values[0]) + f64::from(values[1]);
    assert!((sum - exact).abs() < 0.1, "{sum} instead of {exact}");
    assert_eq!(values[2], 1e8, "the plain sum is expected to stall");
}

/// `sample_value` of the snippet: pcg4d of Jarzynski and Olano 2020.
fn sample_value(pixel: u32, i: u32) -> f32 {
    let mut v = [pixel, i, 0, 0].map(|x: u32| x.wrapping_mul(1_664_525).wrapping_add(1_013_904_223));
    let mix = |v: &mut [u32; 4]| {
        v[0] = v[0].wrapping_add(v[1].wrapping_mul(v[3]));
        v[1] = v[1].wrapping_add(v[2].wrapping_mul(v[0]));
        v[2] = v[2].wrapping_add(v[0].wrapping_mul(v[1]));
        v[3] = v[3].wrapping_add(v[1].wrapping_mul(v[2]));
    };
    mix(&mut v);
    v = v.map(|x| x ^ (x >> 16));
    mix(&mut v);
    let unit = (v[0] >> 8) as f32 * 2f32.powi(-24);
    if v[0] & 1023 == 0 { 2000.0 * unit } else { unit }
}

/// The pass itself, fed with images.
struct Pass {
    pipeline: ComputePipeline,
    shaded: Image,
    accumulator: Buffer,
    counters: Buffer,
    extent: [u32; 2],
}

impl Pass {
    fn new(session: &Session, extent: [u32; 2]) -> Self {
        let file = "passes/accumulate/accumulate.comp";
        let source = ShaderSources::new(shaders_under_test()).load(file).expect("the pass");
        let words = compile(&source, &SpirvCache::of_user()).expect("it compiles");
        let interface = reflect(file, &words).expect("its interface").interface;
        let device = &session.device;
        let module = ShaderModule::new(device, file, &words).expect("a module");
        let none = Specialization::default();
        let pipeline =
            ComputePipeline::new(device, file, &module, &interface, &none, None).expect("a pipeline");
        let desc = ImageDesc { extent, format: Format::Rgba32Float, mip_levels: 1, usage: ImageUse::Target };
        let buffer = |name: &str, size: u64| {
            Buffer::new(device, name, size, BufferUse::General, Location::Device, MemoryUse::Targets)
                .expect("memory")
        };
        let pixels = u64::from(extent[0] * extent[1]);
        Self {
            pipeline,
            shaded: Image::new(device, "shaded", desc).expect("an image"),
            accumulator: buffer("accumulator", pixels * size_of::<AccumulatorPixel>() as u64),
            counters: buffer("counters", 16),
            extent,
        }
    }

    /// Accumulates sample `i` of a still view.
    fn add(&self, session: &mut Session, i: u64, texels: &[[f32; 4]]) {
        let within = i / 2 % BLOCK_SAMPLES;
        let frame = Frame {
            extent_px: self.extent,
            counters: self.counters.address(),
            accumulator: self.accumulator.address(),
            sample_index: i,
            block_start: u32::from(within == 0),
            block_end: u32::from(within == BLOCK_SAMPLES - 1),
            accumulated: i as u32,
            ..bytemuck::Zeroable::zeroed()
        };
        let mut recorder = session.frames.begin().expect("a frame");
        if i == 0 {
            recorder.clear_buffer(&self.counters, 0..4);
        }
        recorder.upload_image(&self.shaded, bytemuck::cast_slice(texels)).expect("an upload");
        let frame_address = recorder.stage_bytes(bytemuck::bytes_of(&frame)).expect("staging");
        let push = Push { frame_address, argument0: 0, argument1: 0 };
        let touches = |buffer| Use::Buffer(buffer, Stage::Compute, Access::StorageReadWrite);
        let uses = [touches(&self.accumulator), touches(&self.counters)];
        let groups = [self.extent[0].div_ceil(8), self.extent[1].div_ceil(8), 1];
        let binds = [("shaded", Bind::Image(&self.shaded))];
        let push = bytemuck::bytes_of(&push);
        recorder.dispatch(&self.pipeline, None, &binds, &uses, push, groups).expect("the pass");
        session.frames.submit(recorder, None).expect("a submission");
    }

    fn read(&self, session: &mut Session, buffer: &Buffer) -> Vec<u8> {
        let size = buffer.size();
        let host = Buffer::new(
            &session.device,
            "read-back",
            size,
            BufferUse::General,
            Location::ReadBack,
            MemoryUse::Staging,
        )
        .expect("memory");
        let mut recorder = session.frames.begin().expect("a frame");
        recorder.copy_buffer(buffer, &host, size).expect("a copy");
        session.frames.submit(recorder, None).expect("a submission");
        session.frames.finish().expect("the device finishes");
        host.mapped().to_vec()
    }
}

#[test]
fn the_pass_drops_and_counts_what_is_not_finite() {
    const EXTENT: [u32; 2] = [9, 5];
    const COUNT: u64 = 200;
    let mut session = session();
    let pass = Pass::new(&session, EXTENT);
    let pixels = (EXTENT[0] * EXTENT[1]) as usize;
    let mut random = Random::new(3);
    let mut exact = vec![[0.0_f64; 4]; pixels];
    let mut naive = vec![0.0_f32; pixels];
    let mut planted = 0_u32;
    for i in 0..COUNT {
        let mut texels = vec![[0.0_f32; 4]; pixels];
        for (pixel, texel) in texels.iter_mut().enumerate() {
            *texel = [random.unit() as f32, random.unit() as f32, random.magnitude(-3.0, 3.0) as f32, 1.0];
            // Pixel 7 is never finite; every seventh sample of pixel 3 holds a NaN or an infinity.
            if pixel == 7 || (pixel == 3 && i % 7 == 0) {
                texel[(i % 3) as usize] = if i % 2 == 0 { f32::NAN } else { f32::NEG_INFINITY };
                planted += 1;
            } else {
                for (sum, value) in exact[pixel].iter_mut().zip(texel.iter()) {
                    *sum += f64::from(*value);
                }
            }
            naive[pixel] += texel[0];
        }
        pass.add(&mut session, i, &texels);
    }
    let bytes = pass.read(&mut session, &pass.accumulator);
    let sums: Vec<AccumulatorPixel> = bytes.chunks_exact(96).map(bytemuck::pod_read_unaligned).collect();
    for (pixel, sum) in sums.iter().enumerate().take(pixels) {
        for (channel, expected) in exact[pixel].into_iter().enumerate() {
            let parts = sum.stream.iter().flat_map(|s| [s.block[channel], s.high[channel], s.low[channel]]);
            let total: f64 = parts.map(f64::from).sum();
            assert!(
                (total - expected).abs() <= 1e-6 * expected,
                "pixel {pixel}, channel {channel}: {total} {expected}"
            );
        }
    }
    let counted: u32 = bytemuck::pod_read_unaligned(&pass.read(&mut session, &pass.counters)[..4]);
    assert_eq!(counted, planted);
    assert!(!naive[3].is_finite() && !naive[7].is_finite(), "the naive sum is expected to be spoilt");
}
