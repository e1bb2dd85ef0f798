//! Where device memory is short: the view in a window gets coarser and grows back, pictures of a set size are refused with a
//! size and a budget that fit, what cannot fit is refused before it is taken in, and asking costs as much as the edit.
#![expect(clippy::expect_used, reason = "a test says what is wrong by panicking")]

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use caustica::session::{Session, SessionOptions, load};
use caustica_gpu::MemoryUse;
use caustica_scene::{Edit, Node, NodeId, NodeKind, Subtree};
use caustica_tests::gpu;
use caustica_tests::models::cube;
use caustica_tests::program::{Run, caustica};

const MIB: u64 = 1 << 20;
const EXTENT: [u32; 2] = [480, 360];
/// Squares along each side of the large model.
const SIDE: usize = 150;

fn write_cube(folder: &Path) -> PathBuf {
    let path = folder.join("cube.gltf");
    std::fs::write(&path, cube(false)).expect("a model");
    path
}

/// A plane of 45,000 triangles, which take 9.6 MiB at the very least and more than twice that in truth.
fn write_plane(folder: &Path) -> PathBuf {
    let mut text = String::new();
    for (x, y) in (0..=SIDE).flat_map(|y| (0..=SIDE).map(move |x| (x, y))) {
        _ = writeln!(text, "v {} {} 0", x as f32 / SIDE as f32, y as f32 / SIDE as f32);
    }
    for corner in (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| y * (SIDE + 1) + x + 1)) {
        let above = corner + SIDE + 1;
        _ = writeln!(text, "f {corner} {} {} {above}", corner + 1, above + 1);
    }
    let path = folder.join("plane.obj");
    std::fs::write(&path, text).expect("a model");
    path
}

fn window_on(device: &std::sync::Arc<caustica_gpu::Device>) -> Session {
    let options = SessionOptions { extent: EXTENT, window: true, ..SessionOptions::default() };
    Session::new(device, options).expect("a session")
}

/// The error in words.
fn import(session: &mut Session, path: &Path) -> Result<(), String> {
    let loaded = load(path, false, &|_, _| {}).expect("a model");
    session.import(path, loaded).map(drop).map_err(|error| format!("{error:#}"))
}

fn frames(session: &mut Session, count: usize) {
    for _ in 0..count {
        let recorder = session.begin_frame(EXTENT).expect("a frame");
        session.submit(recorder, None).expect("a submission");
    }
}

#[test]
fn a_view_in_a_window_gets_coarser_and_grows_back() {
    let folder = tempfile::tempdir().expect("a folder");
    let (cube, plane) = (write_cube(folder.path()), write_plane(folder.path()));
    let (little, targets, much) = {
        let gpu = gpu::session();
        let mut session = window_on(&gpu.device);
        import(&mut session, &cube).expect("a cube");
        frames(&mut session, 6);
        let little = gpu.device.memory_budget().used_bytes;
        let by_use = gpu.device.memory_by_use();
        let targets = by_use.iter().find(|(kind, _)| *kind == MemoryUse::Targets).expect("targets").1;
        import(&mut session, &plane).expect("a plane");
        frames(&mut session, 12);
        assert_eq!((session.least_divisor(), session.divisor()), (1, 1));
        (little, targets, gpu.device.memory_budget().used_bytes)
    };
    let limit = little + targets * 3 / 10;
    let mib = |bytes: u64| bytes / MIB;
    println!(
        "{} MiB, of which {} targets; with the plane {}; allowed {}",
        mib(little),
        mib(targets),
        mib(much),
        mib(limit)
    );
    assert!(much > limit + 4 * MIB, "the plane makes no difference");

    let gpu = gpu::session_within(limit);
    let mut session = window_on(&gpu.device);
    import(&mut session, &cube).expect("a cube");
    frames(&mut session, 6);
    assert_eq!((session.least_divisor(), session.divisor()), (1, 1), "the cube alone has room");
    import(&mut session, &plane).expect("what it at least needs is there");
    frames(&mut session, 12);
    let coarse = session.least_divisor();
    assert!(coarse > 1 && session.divisor() == coarse, "{coarse}");
    assert!(session.samples() > 0, "there is a picture");
    assert!(session.shortage().contains("a larger --memory-budget"), "{}", session.shortage());
    frames(&mut session, 12);
    assert_eq!(session.least_divisor(), coarse, "it does not swing");
    session.undo();
    frames(&mut session, 20);
    assert_eq!((session.least_divisor(), session.divisor()), (1, 1), "there is room again");
    assert!(session.samples() > 0);
    drop(session);
}

#[test]
fn meshes_that_cannot_fit_are_refused_in_words_before_they_are_taken_in() {
    let folder = tempfile::tempdir().expect("a folder");
    let plane = write_plane(folder.path());
    let gpu = gpu::session_within(14 * MIB);
    let options = SessionOptions { extent: [8, 8], ..SessionOptions::default() };
    let mut session = Session::new(&gpu.device, options).expect("a session");
    import(&mut session, &plane).expect("one could fit");
    let before = session.document().clone();
    // The same file once more would be another instance, which takes no room.
    let other = folder.path().join("other.obj");
    std::fs::copy(&plane, &other).expect("a copy");
    let refused = import(&mut session, &other).expect_err("two cannot");
    println!("{refused}");
    assert!(
        refused.contains("the meshes of the scene take at least 19.") && refused.contains("there are 14;"),
        "{refused}"
    );
    assert!(refused.contains("fewer or simpler meshes") && refused.contains("--memory-budget"), "{refused}");
    assert!(*session.document() == before && session.history().undo_count() == 1, "nothing was taken in");
    let top = session.document().roots()[0];
    let prefab = session.document().node(top).and_then(Node::prefab).expect("an instance");
    let again = load(&plane, false, &|_, _| {}).expect("a model");
    session.replace_source(prefab, again).expect("what takes its own place needs no more");
}

fn least(repeat: usize, mut work: impl FnMut() -> Duration) -> Duration {
    (0..repeat).map(|_| work()).min().unwrap_or_default()
}

fn timed(work: impl FnOnce()) -> Duration {
    let start = Instant::now();
    work();
    start.elapsed()
}

#[test]
fn an_import_costs_what_it_brings_and_not_the_scene() {
    const NODES: usize = 100_000;
    let folder = tempfile::tempdir().expect("a folder");
    let cube = write_cube(folder.path());
    let gpu = gpu::session();
    let options = SessionOptions { extent: [8, 8], ..SessionOptions::default() };
    let mut session = Session::new(&gpu.device, options).expect("a session");
    let frame = |session: &mut Session| {
        let recorder = session.begin_frame([8, 8]).expect("a frame");
        session.submit(recorder, None).expect("a submission");
    };
    let add = |document: &mut caustica_scene::Document| {
        let nodes = (0..NODES)
            .map(|place| (NodeId(document.allocate_id()), Node::new(format!("n{place}"), NodeKind::Group)));
        let mut nodes: Vec<_> = nodes.collect();
        let top = nodes[0].0;
        nodes.iter_mut().skip(1).for_each(|(_, node)| node.parent = Some(top));
        ((), Edit::AddNode { parent: None, index: 0, subtree: Subtree { nodes } })
    };
    let loaded = load(&cube, false, &|_, _| {}).expect("a model");
    let import = |session: &mut Session| {
        least(7, || {
            let loaded = loaded.clone();
            let taken = timed(|| assert!(session.import(&cube, loaded).expect("room").node.is_some()));
            frame(session);
            taken
        })
    };
    let alone = import(&mut session);
    session.edit_with(add).expect("many nodes");
    frame(&mut session);
    let importing = import(&mut session);
    let copying = least(7, || timed(|| drop(session.document().clone())));
    println!(
        "import into nothing {alone:.1?}, into {NODES} nodes {importing:.1?}; to copy the document alone would take {copying:.1?}"
    );
    assert!(importing * 4 < copying, "an import costs as much as the scene");
}

fn number_after(text: &str, word: &str) -> Option<String> {
    let rest = text.split(word).nth(1)?;
    rest.split(|c: char| !c.is_ascii_digit() && c != 'x').find(|part| !part.is_empty()).map(str::to_owned)
}

#[test]
fn a_picture_without_room_is_refused_with_a_size_and_a_budget_that_fit() {
    let folder = tempfile::tempdir().expect("a folder");
    write_cube(folder.path());
    let render = |size: &str, budget: &str| -> Run {
        let fixed = ["render", "cube.gltf", "-o", "a.png", "--samples", "1", "--size"];
        caustica(folder.path(), &[&fixed[..], &[size, "--memory-budget", budget]].concat())
    };
    let refused = render("640x480", "64");
    println!("{}", refused.stderr);
    assert_eq!((refused.code, refused.stdout.as_str()), (Some(3), ""), "{}", refused.stderr);
    assert!(refused.stderr.contains("640x480 takes about") && refused.stderr.contains("there are 64;"));
    assert_eq!(refused.stderr.trim().lines().count(), 1, "{}", refused.stderr);
    assert!(!folder.path().join("a.png").exists(), "never another size than was asked for");
    let size = number_after(&refused.stderr, "--size ").expect("a size that fits");
    let budget = number_after(&refused.stderr, "--memory-budget ").expect("a budget that fits");
    for (size, budget) in [(size.as_str(), "64"), ("640x480", budget.as_str())] {
        let run = render(size, budget);
        assert_eq!(run.code, Some(0), "{size} in {budget} MiB: {}", run.stderr);
        let (width, height) = image::image_dimensions(folder.path().join("a.png")).expect("a picture");
        assert_eq!(format!("{width}x{height}"), size);
    }
    let tiny = render("64x48", "1");
    assert_eq!(tiny.code, Some(3), "{}", tiny.stderr);
    assert!(tiny.stderr.contains("or a larger --memory-budget"), "{}", tiny.stderr);
}
