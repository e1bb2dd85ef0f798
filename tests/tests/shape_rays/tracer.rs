//! Traces given rays against given shapes on the device, by the shaders of the repository: boxes by `shape_boxes.comp`, hits by
//! `shape.rint`, places by `shape_hit.glsl`. Enters: shapes of two geometries, rays. Leaves: what each ray met. It judges nothing.

use std::sync::Arc;

use caustica_gpu::{
    AccelBuild, AccelGeometry, AccelStructure, Access, Bind, BoxGeometry, Buffer, BufferUse, BuildMode,
    BuildPreference, ComputePipeline, Device, HitGroup, Location, MemoryUse, RayTracingDesc,
    RayTracingPipeline, Recorder, ResourceId, SceneSet, Specialization, Stage, TlasInstances, Use,
    pack_instance,
};
use caustica_renderer::gpu_types::{
    Frame, GEOMETRY_MOVED, GEOMETRY_SHAPES, Geometry, Instance, Push, Scene, Shape, ShapeBox, ShapeBoxJob,
};
use caustica_renderer::shader::{Compiled, ShaderSources, Source, SpirvCache, merge_interfaces};
use caustica_tests::compute::{bytes, empty_scene};
use caustica_tests::gpu::Session;
use caustica_tests::shaders_under_test;

/// Rays of a row of the launch; their number is a multiple of it.
pub const ROW: usize = 1000;
const IDENTITY: [[f32; 4]; 3] = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];

/// A ray, world space.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Ray {
    pub origin: [f32; 3],
    pub direction: [f32; 3],
}

/// What a ray met.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Found {
    /// Below 0: nothing.
    pub t_m: f32,
    pub geometry: u32,
    pub primitive: u32,
    /// `HIT_*`.
    pub kind: u32,
    /// Outwards, unit length.
    pub normal: [f32; 3],
}

/// The shapes of one geometry.
pub struct Part {
    pub shapes: Vec<Shape>,
    /// `None`: it was not moved.
    pub mesh_from_primitive: Option<[[f32; 4]; 3]>,
}

const HEAD: &str = "#version 460
#extension GL_GOOGLE_include_directive : require
#include \"shared/rays.glsl\"
#include \"shared/frame.glsl\"
struct Found { float t_m; uint geometry; uint primitive; uint kind; vec3 normal; };
";
const RAY_GENERATION: &str = "
struct Ray { vec3 origin; vec3 direction; };
layout(set = 1, binding = 0, scalar) readonly buffer Rays { Ray at[]; } rays;
layout(set = 1, binding = 1, scalar) writeonly buffer Results { Found at[]; } results;
layout(location = 0) rayPayloadEXT Found found;
void main() {
    uint index = gl_LaunchIDEXT.y * gl_LaunchSizeEXT.x + gl_LaunchIDEXT.x;
    Ray ray = rays.at[index];
    found = Found(-1.0, 0u, 0u, 0u, vec3(0.0));
    traceRayEXT(scene_tlas, gl_RayFlagsNoneEXT, 0xffu, 0u, 0u, 0u, ray.origin, 0.0, ray.direction, 1e30, 0);
    results.at[index] = found;
}";
const CLOSEST_HIT: &str = "
#include \"passes/rays/shape_hit.glsl\"
layout(location = 0) rayPayloadInEXT Found found;
void main() {
    Scene scene = SceneTable(FrameTable(push.frame_address).frame.scene).scene;
    PlacedShape shape = shape_fetch(scene, gl_InstanceCustomIndexEXT, gl_GeometryIndexEXT, gl_PrimitiveID);
    ShapePlace place = shape_decode_place(shape.kind, shape_hit_place(scene, gl_HitKindEXT));
    found = Found(gl_HitTEXT, gl_GeometryIndexEXT, gl_PrimitiveID, gl_HitKindEXT, shape_point(shape, place).normal);
}";
const MISS: &str = "
layout(location = 0) rayPayloadInEXT Found found;
void main() {}";

/// A shader of its own that includes those of the repository.
fn own(device: &Arc<Device>, file: &str, body: &str) -> Compiled {
    let sources = ShaderSources::new(shaders_under_test());
    let mut texts = std::collections::BTreeMap::new();
    for include in ["shared/rays.glsl", "shared/frame.glsl", "passes/rays/shape_hit.glsl"] {
        texts.extend(sources.load(include).expect("an include").texts);
    }
    texts.insert(file.to_owned(), format!("{HEAD}{body}"));
    built(device, Source { file: file.to_owned(), texts, ..Source::default() })
}

fn built(device: &Arc<Device>, source: Source) -> Compiled {
    Compiled::new(device, source, &SpirvCache::of_user()).expect("it compiles and fits")
}

fn of_repository(device: &Arc<Device>, file: &str) -> Compiled {
    built(device, ShaderSources::new(shaders_under_test()).load(file).expect("a shader of the repository"))
}

fn buffer(device: &Arc<Device>, size: u64, location: Location) -> Buffer {
    Buffer::new(device, "rays", size, BufferUse::Geometry, location, MemoryUse::Geometry).expect("memory")
}

fn uploaded(device: &Arc<Device>, recorder: &mut Recorder, data: &[u8]) -> Buffer {
    let target = buffer(device, data.len() as u64, Location::Device);
    recorder.upload(&target, 0, data).expect("an upload");
    target
}

/// The scene on the device.
struct Tables {
    shapes: Vec<Buffer>,
    boxes: Vec<Buffer>,
    geometries: Buffer,
    instances: Buffer,
    frame: Buffer,
    scene: Buffer,
}

impl Tables {
    fn new(device: &Arc<Device>, recorder: &mut Recorder, parts: &[Part]) -> Self {
        let shapes: Vec<Buffer> =
            parts.iter().map(|part| uploaded(device, recorder, bytes(&part.shapes))).collect();
        let box_size = |part: &Part| (part.shapes.len() * size_of::<ShapeBox>()) as u64;
        let boxes = parts.iter().map(|part| buffer(device, box_size(part), Location::Device)).collect();
        let records: Vec<Geometry> = parts.iter().zip(&shapes).map(|(part, at)| record(part, at)).collect();
        let geometries = uploaded(device, recorder, bytes(&records));
        let instance = Instance {
            render_from_mesh: IDENTITY,
            previous_render_from_mesh: IDENTITY,
            normal_from_mesh: IDENTITY,
            geometries: geometries.address(),
            geometry_count: parts.len() as u32,
            ..bytemuck::Zeroable::zeroed()
        };
        let instances = uploaded(device, recorder, bytes(&[instance]));
        let scene = Scene { instances: instances.address(), ..bytemuck::Zeroable::zeroed() };
        let scene = uploaded(device, recorder, bytes(&[scene]));
        let frame = Frame { scene: scene.address(), ..bytemuck::Zeroable::zeroed() };
        let frame = uploaded(device, recorder, bytes(&[frame]));
        Self { shapes, boxes, geometries, instances, frame, scene }
    }

    fn read_by(&self, stage: Stage) -> Vec<Use<'_>> {
        let single = [&self.geometries, &self.instances, &self.frame, &self.scene];
        let all = self.shapes.iter().chain(single);
        all.map(|table| Use::Buffer(table, stage, Access::StorageRead)).collect()
    }

    fn make_boxes(&self, device: &Arc<Device>, recorder: &mut Recorder, parts: &[Part]) {
        let pass = of_repository(device, "passes/shape_boxes/shape_boxes.comp");
        let general = Specialization::default();
        let pipeline =
            ComputePipeline::new(device, pass.file(), &pass.module, &pass.interface, &general, None)
                .expect("a pipeline");
        for (index, (part, boxes)) in parts.iter().zip(&self.boxes).enumerate() {
            let job = ShapeBoxJob {
                geometry: self.geometries.address() + (index * size_of::<Geometry>()) as u64,
                boxes: boxes.address(),
                count: part.shapes.len() as u32,
                pad0: 0,
            };
            let frame_address = recorder.stage_bytes(bytes(&[job])).expect("staging memory");
            let push = [Push { frame_address, argument0: 0, argument1: 0 }];
            let mut uses = self.read_by(Stage::Compute);
            uses.push(Use::Buffer(boxes, Stage::Compute, Access::StorageReadWrite));
            recorder.dispatch(&pipeline, None, &[], &uses, bytes(&push), [1, 1, 1]).expect("the pass runs");
        }
    }
}

fn record(part: &Part, shapes: &Buffer) -> Geometry {
    let moved = if part.mesh_from_primitive.is_some() { GEOMETRY_MOVED } else { 0 };
    let map = part.mesh_from_primitive.unwrap_or(IDENTITY);
    Geometry {
        positions: shapes.address(),
        previous_positions: shapes.address(),
        triangle_count: part.shapes.len() as u32,
        flags: GEOMETRY_SHAPES | moved,
        mesh_from_primitive: map,
        previous_mesh_from_primitive: map,
        ..bytemuck::Zeroable::zeroed()
    }
}

/// BLAS and TLAS, with what they were built from.
struct Structures {
    _blas: AccelStructure,
    tlas: AccelStructure,
    groups: [ResourceId; 2],
    _kept: [Buffer; 3],
}

/// Records one build.
fn build(
    device: &Arc<Device>,
    recorder: &mut Recorder,
    geometry: AccelGeometry<'_>,
    uses: &[Use<'_>],
) -> (AccelStructure, Buffer) {
    let preference = BuildPreference::FastTrace;
    let sizes = device.build_sizes(geometry, preference);
    let top_level = matches!(geometry, AccelGeometry::Instances(_));
    let target = AccelStructure::new(device, "shapes", sizes.structure, top_level).expect("memory");
    let memory = buffer(device, sizes.build_scratch, Location::Device);
    let (mode, scratch) = (BuildMode::Build, memory.address());
    recorder.build(&[AccelBuild { target: &target, geometry, preference, mode, scratch }], uses);
    (target, memory)
}

fn structures(device: &Arc<Device>, recorder: &mut Recorder, tables: &Tables, parts: &[Part]) -> Structures {
    let geometry = |(part, at): (&Part, &Buffer)| BoxGeometry {
        boxes: at.address(),
        count: part.shapes.len() as u32,
        opaque: true,
    };
    let boxes: Vec<BoxGeometry> = parts.iter().zip(&tables.boxes).map(geometry).collect();
    let groups = [device.new_resource_id(), device.new_resource_id()];
    let written = |group| Use::Group(group, Stage::AccelBuild, Access::AccelWrite);
    let read = |at| Use::Buffer(at, Stage::AccelBuild, Access::BuildInput);
    let uses: Vec<Use<'_>> = tables.boxes.iter().map(read).chain([written(groups[0])]).collect();
    let (blas, scratch) = build(device, recorder, AccelGeometry::Boxes(&boxes), &uses);
    let descriptor = uploaded(device, recorder, &pack_instance(IDENTITY, 0, 0xff, 0, blas.address()));
    let uses =
        [read(&descriptor), Use::Group(groups[0], Stage::AccelBuild, Access::AccelRead), written(groups[1])];
    let instances = TlasInstances { descriptors: descriptor.address(), count: 1 };
    let (tlas, top_scratch) = build(device, recorder, AccelGeometry::Instances(instances), &uses);
    Structures { _blas: blas, tlas, groups, _kept: [scratch, descriptor, top_scratch] }
}

fn pipeline(device: &Arc<Device>, set: &SceneSet) -> RayTracingPipeline {
    let parts = [
        own(device, "rays.rgen", RAY_GENERATION),
        own(device, "rays.rmiss", MISS),
        own(device, "rays.rchit", CLOSEST_HIT),
        of_repository(device, "passes/rays/shape.rint"),
    ];
    let interface = merge_interfaces(&parts.iter().collect::<Vec<_>>()).expect("one interface");
    let [generation, miss, closest, intersection] = &parts;
    let shapes = HitGroup {
        closest_hit: Some(&closest.module),
        intersection: Some(&intersection.module),
        ..HitGroup::default()
    };
    let desc = RayTracingDesc {
        name: "rays",
        ray_generation: &generation.module,
        misses: &[&miss.module],
        hit_groups: &[shapes],
    };
    RayTracingPipeline::new(device, &desc, &interface, &Specialization::default(), Some(set.layout()))
        .expect("a pipeline")
}

/// What each ray meets first.
///
/// # Panics
/// When the device cannot.
pub fn trace(session: &mut Session, parts: &[Part], rays: &[Ray]) -> Vec<Found> {
    assert!(rays.len().is_multiple_of(ROW), "whole rows of rays");
    let device = Arc::clone(&session.device);
    let mut recorder = session.frames.begin().expect("a frame");
    let tables = Tables::new(&device, &mut recorder, parts);
    tables.make_boxes(&device, &mut recorder, parts);
    let built = structures(&device, &mut recorder, &tables, parts);
    let set = empty_scene(&device, &mut recorder);
    set.set_tlas(&built.tlas);
    let pipeline = pipeline(&device, &set);
    let size = (rays.len() * size_of::<Found>()) as u64;
    let input = uploaded(&device, &mut recorder, bytes(rays));
    let results = buffer(&device, size, Location::Device);
    let host = buffer(&device, size, Location::ReadBack);
    let push = [Push { frame_address: tables.frame.address(), argument0: 0, argument1: 0 }];
    let binds = [("rays", Bind::Buffer(&input)), ("results", Bind::Buffer(&results))];
    let mut uses = tables.read_by(Stage::RayTracing);
    uses.extend(built.groups.map(|group| Use::Group(group, Stage::RayTracing, Access::AccelTrace)));
    let extent = [ROW as u32, (rays.len() / ROW) as u32];
    recorder.trace_rays(&pipeline, Some(&set), &binds, &uses, bytes(&push), extent).expect("rays");
    recorder.copy_buffer(&results, &host, size).expect("a copy");
    session.frames.submit(recorder, None).expect("a submission");
    session.frames.finish().expect("the device finishes");
    bytemuck::pod_collect_to_vec(&host.mapped()[..size as usize])
}
