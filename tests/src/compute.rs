//! Runs a snippet of GLSL that includes the shader library. Enters: the body of a function, input buffers. Leaves:
//! what each invocation wrote. The snippet goes through the renderer's own compiler and reflection.
//!
//! In a snippet: `COUNT` invocations run; `write(i, x)` stores value `i` of this invocation; `input.at[k]` is the
//! device address of input buffer `k`, to be read as `UintTable(input.at[k])`, `FloatTable(..)` or any table of
//! `shared/scene.glsl`.

use std::fmt::Write as _;
use std::sync::Arc;

use bytemuck::Pod;
use caustica_gpu::{
    Access, Bind, Buffer, BufferUse, ComputePipeline, Device, Filter, Format, Image, ImageDesc, ImageUse,
    Location, MemoryUse, Sampler, SamplerDesc, SceneSet, ShaderModule, Specialization, Stage, Use, WrapMode,
};
use caustica_renderer::shader::{ShaderSources, Source, SpirvCache, compile, reflect};

use crate::gpu::Session;
use crate::shaders_under_test;

const LOCAL_SIZE: u32 = 64;

const HEADER: &str = r"
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference2 : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer FloatTable { float at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Vec3Table { vec3 at[]; };
layout(set = 1, binding = 0, scalar) writeonly buffer Results { float at[]; } results;
layout(set = 1, binding = 1, scalar) readonly buffer Inputs { uint64_t at[]; } inputs;
";

/// A snippet and what it reads.
#[derive(Default)]
pub struct Snippet<'a> {
    /// Files of the shader folder that it includes.
    pub includes: &'a [&'a str],
    /// Functions of its own, before `main`.
    pub functions: &'a str,
    /// Body of `void run(uint index)`.
    pub body: &'a str,
    /// Values that each invocation writes.
    pub values: usize,
    /// Invocations.
    pub count: usize,
    /// Input buffers.
    pub inputs: &'a [&'a [u8]],
    /// Values of specialisation constants.
    pub specialization: Specialization,
}

/// Bytes of a slice, as an input buffer.
pub fn bytes<T: Pod>(values: &[T]) -> &[u8] {
    bytemuck::cast_slice(values)
}

/// Reads a file of the shader folder, to take functions out of it.
///
/// # Panics
/// When it is not there.
pub fn shader_text(file: &str) -> String {
    ShaderSources::new(shaders_under_test()).read(file).expect("a shader of the repository")
}

/// Runs a snippet; the result holds `values` floats for each of `count` invocations.
///
/// # Panics
/// When it does not compile or the device fails.
pub fn run(session: &mut Session, snippet: &Snippet<'_>) -> Vec<f32> {
    let source = source_of(snippet);
    let words = compile(&source, &SpirvCache::of_user()).expect("the snippet compiles");
    let interface = reflect(&source.file, &words).expect("the snippet's interface fits").interface;
    let device = Arc::clone(&session.device);
    let module = ShaderModule::new(&device, &source.file, &words).expect("a shader module");
    let buffer = |name: &str, size: usize, location| {
        Buffer::new(&device, name, size as u64, BufferUse::General, location, MemoryUse::Tables)
            .expect("memory")
    };
    let inputs: Vec<Buffer> =
        snippet.inputs.iter().map(|data| buffer("input", data.len(), Location::Device)).collect();
    let addresses = buffer("input addresses", inputs.len().max(1) * 8, Location::Device);
    let size = snippet.values * snippet.count * 4;
    let results = buffer("results", size, Location::Device);
    let host = buffer("results", size, Location::ReadBack);

    let mut recorder = session.frames.begin().expect("a frame");
    let set = interface.uses_scene.then(|| empty_scene(&device, &mut recorder));
    let pipeline = ComputePipeline::new(
        &device,
        &source.file,
        &module,
        &interface,
        &snippet.specialization,
        set.as_ref().map(|set| &**set.layout()),
    )
    .expect("a pipeline");
    for (target, data) in inputs.iter().zip(snippet.inputs) {
        recorder.upload(target, 0, data).expect("an upload");
    }
    let address_list: Vec<u64> = inputs.iter().map(Buffer::address).collect();
    recorder.upload(&addresses, 0, bytes(&address_list)).expect("an upload");
    let uses: Vec<Use<'_>> =
        inputs.iter().map(|input| Use::Buffer(input, Stage::Compute, Access::StorageRead)).collect();
    let all_binds = [("results", Bind::Buffer(&results)), ("inputs", Bind::Buffer(&addresses))];
    let binds: Vec<(&str, Bind<'_>)> = all_binds
        .into_iter()
        .filter(|(name, _)| interface.bindings.iter().any(|binding| binding.name == *name))
        .collect();
    let groups = (snippet.count as u32).div_ceil(LOCAL_SIZE);
    recorder
        .dispatch(&pipeline, set.as_ref(), &binds, &uses, &[0; 16], [groups, 1, 1])
        .expect("the snippet runs");
    recorder.copy_buffer(&results, &host, size as u64).expect("a copy");
    session.frames.submit(recorder, None).expect("a submission");
    session.frames.finish().expect("the device finishes");
    host.mapped()[..size].chunks_exact(4).map(|b| f32::from_ne_bytes([b[0], b[1], b[2], b[3]])).collect()
}

fn source_of(snippet: &Snippet<'_>) -> Source {
    let sources = ShaderSources::new(shaders_under_test());
    let mut text = String::from("#version 460\n#extension GL_GOOGLE_include_directive : require\n");
    let mut texts = std::collections::BTreeMap::new();
    let _ = writeln!(text, "layout(local_size_x = {LOCAL_SIZE}) in;");
    for include in snippet.includes {
        let _ = writeln!(text, "#include \"{include}\"");
        texts.extend(sources.load(include).expect("an include of the snippet").texts);
    }
    let (count, values) = (snippet.count, snippet.values);
    text.push_str(HEADER);
    let _ = writeln!(text, "const uint COUNT = {count}u;");
    let _ = writeln!(
        text,
        "void write(uint i, float x) {{ results.at[gl_GlobalInvocationID.x * {values}u + i] = x; }}\n\
         void write(uint i, vec3 x) {{ write(i, x.x); write(i + 1u, x.y); write(i + 2u, x.z); }}"
    );
    let _ = writeln!(text, "{}\nvoid run(uint index) {{\n{}\n}}", snippet.functions, snippet.body);
    text.push_str("void main() { if (gl_GlobalInvocationID.x < COUNT) { run(gl_GlobalInvocationID.x); } }\n");
    let file = String::from("snippet.comp");
    texts.insert(file.clone(), text);
    Source { file, texts, ..Source::default() }
}

/// A set 0 whose textures and environment are one white texel; it has no TLAS yet.
///
/// # Panics
/// When memory runs out.
pub fn empty_scene(device: &Arc<Device>, recorder: &mut caustica_gpu::Recorder) -> SceneSet {
    let desc =
        ImageDesc { extent: [1, 1], format: Format::Rgba8Unorm, mip_levels: 1, usage: ImageUse::Texture };
    let white = Image::new(device, "white", desc).expect("an image");
    recorder.upload_image(&white, &[255; 4]).expect("an upload");
    let sampler = Sampler::new(
        device,
        SamplerDesc {
            mag: Filter::Linear,
            min: Filter::Linear,
            mip: Filter::Nearest,
            mipmaps: false,
            wrap: [WrapMode::Repeat; 2],
            anisotropy: 1,
        },
    )
    .expect("a sampler");
    let set = SceneSet::new(device, 1, &white, &sampler).expect("a descriptor set");
    // The image outlives this frame through the retire queue.
    set
}
