//! Acceleration structures as the gpu layer makes them, in a frame and in the background: what is built, compacted or
//! refitted is traced, and the distances must be those of the geometry.
#![expect(clippy::expect_used, clippy::panic, reason = "a test says what is wrong by panicking")]

use std::collections::BTreeMap;
use std::sync::Arc;

use caustica_gpu::{
    AccelBuild, AccelGeometry, AccelStructure, Access, BOX_STRIDE, Background, BackgroundWork, Bind,
    BoxGeometry, Buffer, BufferUse, BuildMode, BuildPreference, Device, GpuError, HitGroup, Location,
    MemoryUse, RayTracingDesc, RayTracingPipeline, ResourceId, Specialization, Stage, TlasInstances,
    TriangleGeometry, Use, pack_instance,
};
use caustica_renderer::shader::{Compiled, Source, SpirvCache, merge_interfaces};
use caustica_tests::gpu::{Session, session};

/// Rays along each side of the unit square.
const RAYS: u32 = 16;
/// What the tracer writes where nothing was hit.
const MISSED: f32 = -1.0;

const PUSH: &str = r"
#extension GL_EXT_ray_tracing : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
layout(push_constant, scalar) uniform LabPush { uint64_t boxes; uint group; } push;
";

/// Straight down from z = 1 through the centres of a grid over the unit square.
const RAY_GENERATION: &str = r"
layout(set = 1, binding = 0) uniform accelerationStructureEXT scene;
layout(set = 1, binding = 1, scalar) writeonly buffer Results { float at[]; } results;
layout(location = 0) rayPayloadEXT float distance_m;
void main() {
    vec2 at = (vec2(gl_LaunchIDEXT.xy) + 0.5) / vec2(gl_LaunchSizeEXT.xy);
    distance_m = -2.0;
    traceRayEXT(scene, gl_RayFlagsNoneEXT, 0xff, push.group, 0, 0, vec3(at, 1.0), 0.0, vec3(0, 0, -1), 10.0, 0);
    results.at[gl_LaunchIDEXT.y * gl_LaunchSizeEXT.x + gl_LaunchIDEXT.x] = distance_m;
}";
const MISS: &str = r"
layout(location = 0) rayPayloadInEXT float distance_m;
void main() { distance_m = -1.0; }";
const CLOSEST_HIT: &str = r"
layout(location = 0) rayPayloadInEXT float distance_m;
void main() { distance_m = gl_HitTEXT; }";
/// The top of a box, read from the boxes that the structure was built from.
const INTERSECTION: &str = r"
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Boxes { float at[]; };
void main() {
    Boxes boxes = Boxes(push.boxes);
    int first = gl_PrimitiveID * 6;
    vec2 at = gl_ObjectRayOriginEXT.xy;
    bool inside = at.x >= boxes.at[first] && at.x <= boxes.at[first + 3]
        && at.y >= boxes.at[first + 1] && at.y <= boxes.at[first + 4];
    if (inside) reportIntersectionEXT(gl_ObjectRayOriginEXT.z - boxes.at[first + 5], 0u);
}";

fn stage(device: &Arc<Device>, file: &str, body: &str) -> Compiled {
    let texts = BTreeMap::from([(file.to_owned(), format!("#version 460\n{PUSH}{body}"))]);
    let source = Source { file: file.to_owned(), texts, ..Source::default() };
    Compiled::new(device, source, &SpirvCache::of_user()).expect("it compiles and fits")
}

/// A device with what all tests here do on it.
struct Lab {
    session: Session,
    pipeline: RayTracingPipeline,
    /// Stands for every BLAS that a frame builds.
    group: ResourceId,
}

/// Which hit group a structure needs.
#[derive(Clone, Copy)]
enum Shape<'a> {
    Triangles,
    Boxes(&'a Buffer),
}

impl Lab {
    fn new() -> Self {
        let session = session();
        let device = &session.device;
        eprintln!("background on a queue of its own: {}", device.has_async_queue());
        let parts = [
            stage(device, "lab.rgen", RAY_GENERATION),
            stage(device, "lab.rmiss", MISS),
            stage(device, "lab.rchit", CLOSEST_HIT),
            stage(device, "lab.rint", INTERSECTION),
        ];
        let interface = merge_interfaces(&parts.iter().collect::<Vec<_>>()).expect("one interface");
        let [generation, miss, closest, intersection] = &parts;
        let triangles = HitGroup { closest_hit: Some(&closest.module), ..HitGroup::default() };
        let boxes = HitGroup { intersection: Some(&intersection.module), ..triangles };
        let desc = RayTracingDesc {
            name: "lab",
            ray_generation: &generation.module,
            misses: &[&miss.module],
            hit_groups: &[triangles, boxes],
        };
        let pipeline = RayTracingPipeline::new(device, &desc, &interface, &Specialization::default(), None)
            .expect("a pipeline");
        let group = device.new_resource_id();
        Self { session, pipeline, group }
    }

    fn device(&self) -> &Arc<Device> {
        &self.session.device
    }

    fn buffer(&self, size: u64, usage: BufferUse, location: Location) -> Buffer {
        Buffer::new(self.device(), "lab", size, usage, location, MemoryUse::Geometry).expect("memory")
    }

    /// Puts bytes on the device in a frame of its own, without waiting for it.
    fn upload(&mut self, bytes: &[u8]) -> Buffer {
        let buffer = self.buffer(bytes.len() as u64, BufferUse::Geometry, Location::Device);
        self.write(&buffer, bytes);
        buffer
    }

    fn write(&mut self, buffer: &Buffer, bytes: &[u8]) {
        let mut recorder = self.session.frames.begin().expect("a frame");
        recorder.upload(buffer, 0, bytes).expect("an upload");
        self.session.frames.submit(recorder, None).expect("a submission");
    }

    fn grid(&mut self, side: u32, height_m: f32) -> Grid {
        let (positions, indices) = (grid_positions(side, height_m), grid_indices(side));
        Grid {
            positions: self.upload(bytemuck::cast_slice(&positions)),
            indices: self.upload(bytemuck::cast_slice(&indices)),
            transform: self.upload(bytemuck::cast_slice(&IDENTITY)),
            side,
        }
    }

    fn structure(
        &self,
        geometry: AccelGeometry<'_>,
        preference: BuildPreference,
    ) -> (AccelStructure, Buffer) {
        let sizes = self.device().build_sizes(geometry, preference);
        assert!(sizes.structure > 0, "a structure takes memory");
        let top_level = matches!(geometry, AccelGeometry::Instances(_));
        let scratch = sizes.build_scratch.max(sizes.refit_scratch);
        (
            AccelStructure::new(self.device(), "lab", sizes.structure, top_level).expect("memory"),
            self.buffer(scratch, BufferUse::General, Location::Device),
        )
    }

    /// Builds or refits in a frame, without waiting for it.
    fn build_in_frame(&mut self, build: AccelBuild<'_>, input: &Buffer) {
        let mut recorder = self.session.frames.begin().expect("a frame");
        recorder.build(
            &[build],
            &[
                Use::Buffer(input, Stage::AccelBuild, Access::BuildInput),
                Use::Group(self.group, Stage::AccelBuild, Access::AccelWrite),
            ],
        );
        self.session.frames.submit(recorder, None).expect("a submission");
    }

    /// Puts a structure into a TLAS in the same frame that traces it; returns the distances.
    fn trace(&mut self, blas: &AccelStructure, shape: Shape<'_>) -> Vec<f32> {
        let instance = pack_instance(
            [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]],
            0,
            0xff,
            0,
            blas.address(),
        );
        let descriptors = self.upload(&instance);
        let instances = TlasInstances { descriptors: descriptors.address(), count: 1 };
        let geometry = AccelGeometry::Instances(instances);
        let (tlas, scratch) = self.structure(geometry, BuildPreference::FastTrace);
        let bytes = u64::from(RAYS * RAYS) * 4;
        let results = self.buffer(bytes, BufferUse::General, Location::Device);
        let host = self.buffer(bytes, BufferUse::General, Location::ReadBack);
        let group = self.device().new_resource_id();
        let (boxes, offset) = match shape {
            Shape::Triangles => (0, 0_u32),
            Shape::Boxes(boxes) => (boxes.address(), 1),
        };
        let push = [boxes.to_ne_bytes(), u64::from(offset).to_ne_bytes()].concat();
        let mut recorder = self.session.frames.begin().expect("a frame");
        let build = AccelBuild {
            target: &tlas,
            geometry,
            preference: BuildPreference::FastTrace,
            mode: BuildMode::Build,
            scratch: scratch.address(),
        };
        recorder.build(
            &[build],
            &[
                Use::Buffer(&descriptors, Stage::AccelBuild, Access::BuildInput),
                Use::Group(self.group, Stage::AccelBuild, Access::AccelRead),
                Use::Group(group, Stage::AccelBuild, Access::AccelWrite),
            ],
        );
        let binds = [("scene", Bind::Accel(&tlas)), ("results", Bind::Buffer(&results))];
        let uses = [group, self.group].map(|id| Use::Group(id, Stage::RayTracing, Access::AccelTrace));
        recorder.trace_rays(&self.pipeline, None, &binds, &uses, &push, [RAYS; 2]).expect("rays");
        recorder.copy_buffer(&results, &host, bytes).expect("a copy");
        self.session.frames.submit(recorder, None).expect("a submission");
        self.session.frames.finish().expect("the device finishes");
        bytemuck::pod_collect_to_vec(&host.mapped()[..bytes as usize])
    }
}

const IDENTITY: [f32; 12] = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];

/// A flat grid of triangles over the unit square.
struct Grid {
    positions: Buffer,
    indices: Buffer,
    transform: Buffer,
    side: u32,
}

impl Grid {
    fn geometry(&self) -> [TriangleGeometry; 1] {
        self.geometry_of(&self.positions)
    }

    /// With positions that lie elsewhere.
    fn geometry_of(&self, positions: &Buffer) -> [TriangleGeometry; 1] {
        [TriangleGeometry {
            positions: positions.address(),
            vertex_count: (self.side + 1) * (self.side + 1),
            indices: self.indices.address(),
            triangle_count: self.side * self.side * 2,
            transform: self.transform.address(),
            opaque: true,
        }]
    }
}

fn grid_positions(side: u32, height_m: f32) -> Vec<[f32; 3]> {
    let at = |i: u32| i as f32 / side as f32;
    (0..=side).flat_map(|y| (0..=side).map(move |x| [at(x), at(y), height_m])).collect()
}

fn grid_indices(side: u32) -> Vec<[u32; 3]> {
    let row = side + 1;
    let cell = |x: u32, y: u32| {
        let corner = y * row + x;
        [[corner, corner + 1, corner + row], [corner + 1, corner + row + 1, corner + row]]
    };
    (0..side).flat_map(|y| (0..side).flat_map(move |x| cell(x, y))).collect()
}

fn build<'a>(
    (target, scratch): &'a (AccelStructure, Buffer),
    geometry: AccelGeometry<'a>,
    preference: BuildPreference,
    mode: BuildMode,
) -> AccelBuild<'a> {
    AccelBuild { target, geometry, preference, mode, scratch: scratch.address() }
}

/// Asks until it is finished; `None` is a legal answer until then.
fn poll(background: &mut Background, ticket: caustica_gpu::Ticket) -> Vec<u64> {
    for _ in 0..30_000 {
        if let Some(sizes) = background.finished(ticket).expect("the device is there") {
            return sizes;
        }
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    panic!("the background did not finish within 30 s");
}

fn assert_all_near(found: &[f32], expected: f32) {
    assert_eq!(found.len(), (RAYS * RAYS) as usize);
    for (ray, distance) in found.iter().enumerate() {
        assert!((distance - expected).abs() < 1e-5, "ray {ray}: {distance} instead of {expected}");
    }
}

#[test]
fn the_background_builds_and_compacts_what_frames_trace() {
    let mut lab = Lab::new();
    let mut background = Background::new(lab.device()).expect("a background");
    let (low, high) = (lab.grid(60, 0.25), lab.grid(7, 0.75));
    let snapshot = lab.buffer(high.positions.size(), BufferUse::Geometry, Location::Device);
    let geometries = [low.geometry(), high.geometry_of(&snapshot)];
    let shapes = geometries.each_ref().map(|list| AccelGeometry::Triangles(list));
    let built = shapes.map(|geometry| lab.structure(geometry, BuildPreference::FastTrace));
    // The uploads above were submitted and not waited for: the background waits for them on the device.
    let made = |i: usize| {
        BackgroundWork::Build(build(&built[i], shapes[i], BuildPreference::FastTrace, BuildMode::Build))
    };
    let ticket = background
        .submit(&[
            BackgroundWork::QuerySize(&built[0].0),
            made(0),
            made(1),
            BackgroundWork::QuerySize(&built[1].0),
            BackgroundWork::Copy { from: &high.positions, to: &snapshot, size: high.positions.size() },
        ])
        .expect("a submission");
    let sizes = poll(&mut background, ticket);
    assert_eq!(sizes.len(), 2);
    for (size, (structure, _)) in sizes.iter().zip(&built) {
        assert!((1..=structure.size()).contains(size), "{size} bytes of {}", structure.size());
    }
    assert!(sizes[0] > sizes[1], "7200 triangles take more than 98: {sizes:?}");
    assert_eq!(background.finished(ticket).expect("the device is there"), Some(Vec::new()));

    let compacted: Vec<_> = sizes
        .iter()
        .map(|size| AccelStructure::new(lab.device(), "compacted", *size, false).expect("memory"))
        .collect();
    let copies: Vec<_> =
        built.iter().zip(&compacted).map(|((from, _), to)| BackgroundWork::Compact { from, to }).collect();
    let ticket = background.submit(&copies).expect("a submission");
    assert_eq!(background.wait(ticket).expect("the device finishes"), Vec::<u64>::new());
    drop(built);
    assert_all_near(&lab.trace(&compacted[0], Shape::Triangles), 0.75);
    assert_all_near(&lab.trace(&compacted[1], Shape::Triangles), 0.25);
}

#[test]
fn a_refit_in_a_frame_follows_the_vertices() {
    let mut lab = Lab::new();
    let grid = lab.grid(20, 0.0);
    let list = grid.geometry();
    let shape = AccelGeometry::Triangles(&list);
    let structure = lab.structure(shape, BuildPreference::FastBuild);
    let first = build(&structure, shape, BuildPreference::FastBuild, BuildMode::Build);
    lab.build_in_frame(first, &grid.positions);
    assert_all_near(&lab.trace(&structure.0, Shape::Triangles), 1.0);
    for height_m in [0.5_f32, -1.5] {
        lab.write(&grid.positions, bytemuck::cast_slice(&grid_positions(20, height_m)));
        let again = build(&structure, shape, BuildPreference::FastBuild, BuildMode::Refit);
        lab.build_in_frame(again, &grid.positions);
        assert_all_near(&lab.trace(&structure.0, Shape::Triangles), 1.0 - height_m);
    }
}

/// Boxes over the left half of the unit square, all with the same top.
fn boxes_under(top_m: f32) -> Vec<[f32; 6]> {
    (0..32_u16).map(|i| f32::from(i) / 32.0).map(|y| [0.0, y, -1.0, 0.5, y + 1.0 / 32.0, top_m]).collect()
}

fn assert_boxes(found: &[f32], top_m: f32) {
    for (ray, distance) in found.iter().enumerate() {
        let expected = if ray as u32 % RAYS < RAYS / 2 { 1.0 - top_m } else { MISSED };
        assert!((distance - expected).abs() < 1e-5, "ray {ray}: {distance} instead of {expected}");
    }
}

#[test]
fn boxes_are_built_refitted_and_compacted() {
    let mut lab = Lab::new();
    let boxes = boxes_under(0.25);
    let buffer = lab.upload(bytemuck::cast_slice(&boxes));
    assert_eq!(buffer.size(), boxes.len() as u64 * BOX_STRIDE);
    let list = [BoxGeometry { boxes: buffer.address(), count: boxes.len() as u32, opaque: true }];
    let shape = AccelGeometry::Boxes(&list);

    let mut background = Background::new(lab.device()).expect("a background");
    let fixed = lab.structure(shape, BuildPreference::FastTrace);
    let work = [
        BackgroundWork::Build(build(&fixed, shape, BuildPreference::FastTrace, BuildMode::Build)),
        BackgroundWork::QuerySize(&fixed.0),
    ];
    let ticket = background.submit(&work).expect("a submission");
    let sizes = background.wait(ticket).expect("the device finishes");
    assert!(sizes.len() == 1 && (1..=fixed.0.size()).contains(&sizes[0]), "{sizes:?}");
    let compacted = AccelStructure::new(lab.device(), "compacted", sizes[0], false).expect("memory");
    let copy = [BackgroundWork::Compact { from: &fixed.0, to: &compacted }];
    let ticket = background.submit(&copy).expect("a submission");
    background.wait(ticket).expect("the device finishes");
    assert_boxes(&lab.trace(&compacted, Shape::Boxes(&buffer)), 0.25);

    let moving = lab.structure(shape, BuildPreference::FastBuild);
    lab.build_in_frame(build(&moving, shape, BuildPreference::FastBuild, BuildMode::Build), &buffer);
    assert_boxes(&lab.trace(&moving.0, Shape::Boxes(&buffer)), 0.25);
    lab.write(&buffer, bytemuck::cast_slice(&boxes_under(0.875)));
    lab.build_in_frame(build(&moving, shape, BuildPreference::FastBuild, BuildMode::Refit), &buffer);
    assert_boxes(&lab.trace(&moving.0, Shape::Boxes(&buffer)), 0.875);
}

#[test]
fn what_is_dropped_under_the_background_lives_until_it_is_done() {
    let mut lab = Lab::new();
    let mut background = Background::new(lab.device()).expect("a background");
    let mut tickets = Vec::new();
    for side in [300, 2, 200] {
        let grid = lab.grid(side, 0.0);
        let list = grid.geometry();
        let shape = AccelGeometry::Triangles(&list);
        let structure = lab.structure(shape, BuildPreference::FastTrace);
        let work = [
            BackgroundWork::Build(build(&structure, shape, BuildPreference::FastTrace, BuildMode::Build)),
            BackgroundWork::QuerySize(&structure.0),
        ];
        tickets.push(background.submit(&work).expect("a submission"));
        // Grid, structure and scratch are dropped here; frames go on and free what they can meanwhile.
    }
    assert!(tickets.is_sorted(), "{tickets:?}");
    let held = lab.device().retired_objects();
    assert!(
        held >= 6,
        "{held} objects wait: the structure and five buffers of the newest build at the least"
    );
    for _ in 0..3 {
        lab.write(&lab.buffer(64, BufferUse::General, Location::Device), &[0; 64]);
    }
    // The newest first: the older ones have finished by then, and still know their sizes.
    for ticket in tickets.into_iter().rev() {
        assert_eq!(background.wait(ticket).expect("the device finishes").len(), 1);
    }
    drop(background);
    lab.write(&lab.buffer(64, BufferUse::General, Location::Device), &[0; 64]);
    let recorder = lab.session.frames.begin().expect("a frame");
    lab.session.frames.submit(recorder, None).expect("a submission");
    lab.session.frames.finish().expect("the device finishes");
    assert_eq!(lab.device().retired_objects(), 0, "all is freed once both queues are done");
}

#[test]
fn a_copy_past_the_end_of_a_buffer_is_refused() {
    let lab = Lab::new();
    let mut background = Background::new(lab.device()).expect("a background");
    let (from, to) = (
        lab.buffer(64, BufferUse::General, Location::Device),
        lab.buffer(32, BufferUse::General, Location::Device),
    );
    let refused = background.submit(&[BackgroundWork::Copy { from: &from, to: &to, size: 64 }]);
    assert!(matches!(refused, Err(GpuError::Limit { asked: 64, limit: 32, .. })), "{refused:?}");
}
