//! Spheres and boxes from a document to the picture: placed, picked, edited, undone, empty, and the projects that show them.
#![expect(clippy::expect_used, reason = "a test says what is wrong by panicking")]

use std::path::Path;

use caustica::session::{Session, SessionOptions, ViewCamera, load};
use caustica_renderer::{Pipeline, ViewSettings};
use caustica_scene::{
    Cloud, Edit, Local, MeshId, NodeId, Severity, ShapeFile, ShapeSource, Target, Trs, audit,
};
use caustica_tests::gpu::{self, session};
use caustica_tests::program::caustica;
use glam::{DAffine3, DVec3, Vec3};

// Odd, so that the middle pixel looks along the axis.
const EXTENT: [u32; 2] = [65, 49];

fn new_session(gpu: &gpu::Session) -> Session {
    let settings = ViewSettings { pipeline: Pipeline::Raytraced, jitter: false, ..ViewSettings::default() };
    let options = SessionOptions { settings, extent: EXTENT, ..SessionOptions::default() };
    let mut session = Session::new(&gpu.device, options).expect("a session");
    session.set_camera(ViewCamera::looking_at(DVec3::Z * 5.0, DVec3::ZERO, 0.7, 0.01));
    session
}

fn frame(session: &mut Session) {
    let recorder = session.begin_frame(EXTENT).expect("a frame");
    session.submit(recorder, None).expect("a submission");
    session.finish().expect("the device finishes");
}

/// Who is seen in the middle of the picture, which primitive, and how near the camera.
fn middle(session: &mut Session) -> Option<(NodeId, u32, f64)> {
    frame(session);
    let pick = session.pick(EXTENT.map(|side| side / 2)).expect("a pick")?;
    let at = pick.world_position.expect("a place");
    Some((pick.target.node, pick.primitive, at.z))
}

fn add(session: &mut Session, source: ShapeSource) -> (NodeId, MeshId) {
    let node = session.add_shapes("shapes", source, Local::default()).expect("shapes");
    session.end_gesture();
    (node, session.document().mesh_of(node.into()).expect("a mesh"))
}

fn ball(radius_m: f32) -> ShapeSource {
    ShapeSource::Sphere { centre: Vec3::ZERO, radius_m }
}

fn near(found: Option<(NodeId, u32, f64)>, node: NodeId, z: f64) -> bool {
    found.is_some_and(|(seen, _, at)| seen == node && (at - z).abs() < 1e-3)
}

#[test]
fn shapes_are_seen_reshaped_and_undone_in_the_next_frame() {
    let gpu = session();
    let mut session = new_session(&gpu);
    let (node, mesh) = add(&mut session, ball(1.0));
    assert!(near(middle(&mut session), node, 1.0));
    for radius in [0.9, 0.7, 0.5] {
        session.push(Edit::SetShapes { mesh, source: Box::new(ball(radius)) }).expect("a ball");
        assert!(near(middle(&mut session), node, f64::from(radius)));
    }
    let half_extent_m = Vec3::new(1.0, 1.0, 0.25);
    session.end_gesture();
    let slab = ShapeSource::Box { centre: Vec3::Z, half_extent_m };
    session.push(Edit::SetShapes { mesh, source: Box::new(slab) }).expect("a box");
    assert!(near(middle(&mut session), node, 1.25));
    let mesh_from_primitive = DAffine3::from_translation(DVec3::Z);
    session.push(Edit::SetPrimitiveTransform { mesh, primitive: 0, mesh_from_primitive }).expect("a move");
    assert!(near(middle(&mut session), node, 2.25));
    for expected in [1.25, 0.5, 1.0] {
        assert!(session.undo().is_some());
        assert!(near(middle(&mut session), node, expected), "{expected}");
    }
    // The drag was one step; the next one takes the ball away.
    assert!(session.undo().is_some());
    assert_eq!(middle(&mut session), None);
    assert!(session.redo().is_some());
    assert!(near(middle(&mut session), node, 1.0));
}

#[test]
fn even_and_odd_shapes_are_two_primitives_and_there_may_be_none() {
    let gpu = session();
    let mut session = new_session(&gpu);
    let shapes = [(0.0, 1.0), (-3.0, 0.5)].map(|(z, r)| caustica_scene::Shape::sphere(Vec3::Z * z, r));
    let file = ShapeFile { path: "two.xyz".into(), shapes: Some(shapes.into()) };
    let (node, mesh) = add(&mut session, ShapeSource::File(file.clone()));
    assert_eq!(middle(&mut session).map(|(seen, primitive, _)| (seen, primitive)), Some((node, 0)));
    let aside = DAffine3::from_translation(DVec3::X * 5.0);
    let edit = Edit::SetPrimitiveTransform { mesh, primitive: 0, mesh_from_primitive: aside };
    session.push(edit).expect("a move");
    assert_eq!(middle(&mut session).map(|(seen, primitive, _)| (seen, primitive)), Some((node, 1)));
    session.undo();
    let one = ShapeFile { shapes: Some([shapes[0]].into()), ..file.clone() };
    for source in
        [one, ShapeFile { shapes: Some([].into()), ..file.clone() }, ShapeFile { shapes: None, ..file }]
    {
        let filled = source.shapes.as_ref().is_some_and(|shapes| !shapes.is_empty());
        session.push(Edit::SetShapes { mesh, source: Box::new(ShapeSource::File(source)) }).expect("shapes");
        assert_eq!(middle(&mut session).is_some(), filled);
    }
    let (other, _) = add(&mut session, ShapeSource::Cloud(Cloud { count: 0, ..Cloud::default() }));
    assert_eq!(middle(&mut session), None);
    let local = Local::Trs(Trs::from_translation(DVec3::X));
    session.push(Edit::SetTransform { target: Target::node(other), local }).expect("a move");
    assert_eq!(middle(&mut session), None);
}

#[test]
fn the_projects_open_without_a_finding() {
    for (project, shapes) in [("cloud/cloud", 2_000_000), ("five-stages/five-stages", 4003)] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../projects/{project}.caustica.json"));
        let loaded = load(&path, false, &|_, _| {}).expect("a project");
        let caustica::session::Loaded::Project(read) = loaded else { unreachable!("it is a project") };
        assert_eq!(read.warnings, [], "{project}");
        let findings = audit(&read.document);
        assert!(findings.iter().all(|finding| finding.severity < Severity::Warning), "{findings:?}");
        let placed = read.document.renderables().filter_map(|r| read.document.mesh(r.mesh));
        assert_eq!(placed.map(|mesh| mesh.shape_count()).sum::<usize>(), shapes, "{project}");
    }
}

#[test]
fn a_text_file_of_shapes_renders_and_its_faults_name_the_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("balls.xyz");
    std::fs::write(&file, "x y z r\n0 0 0 1\n2 0 0 0.5 0.5 0.5\n").expect("a file");
    let render = [
        "render",
        "balls.xyz",
        "-o",
        "a.png",
        "--size",
        "32x24",
        "--samples",
        "1",
        "--pipeline",
        "raytraced",
    ];
    let run = caustica(folder.path(), &render);
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    let run = caustica(folder.path(), &["check", "balls.xyz"]);
    assert!(run.code == Some(0) && run.stdout.contains("2 spheres and boxes"), "{}", run.stdout);
    std::fs::write(&file, "0 0 0 1\n0 0 zero 1\n").expect("a file");
    let run = caustica(folder.path(), &["check", "balls.xyz"]);
    assert_eq!(run.code, Some(1));
    assert!(run.stderr.contains("balls.xyz: line 2: \"zero\" is not a number"), "{}", run.stderr);
}
