//! What each event costs through a session, row by row of the design's table of invalidation: structures, bytes, samples and
//! the reason that is given. The rows of the renderer alone are in `acceleration.rs`, which lists all of them.

use std::collections::BTreeSet;

use caustica::session::{Session, ViewCamera};
use caustica_renderer::{AccelPolicy, NeedsMode, Pipeline, Show, TlasWork, ToneMap, ViewSettings};
use caustica_scene::{
    ClipChoice, Document, Edit, Environment, Light, Local, Material, MaterialId, NodeId, NodeKind, Target,
    Trs,
};
use caustica_tests::gpu;
use glam::{DVec3, Vec3};

use crate::{SMALL, frame, furnish, model, new_session, settings};

/// Meshes of an instance of the model that deform: tube and flag.
const DEFORMING: u64 = 2;
/// What a frame uploads that changes nothing: its constants.
const IDLE_BYTES: u64 = 1024;
/// A few records.
const FEW_BYTES: u64 = 4096;

/// What the last frame did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Cost {
    /// BLASes built or refitted.
    blas: u64,
    /// First builds among them.
    new_blas: u64,
    tlas: TlasWork,
    bytes: u64,
    resets: u64,
    samples: u64,
}

/// A session, and what its frames do.
struct Bench {
    session: Session,
    /// What becomes of the TLAS when only transforms or boxes change, on this device.
    refit: TlasWork,
    blas_count: u64,
    /// Steps that furnished the scene.
    steps: usize,
}

/// A camera before the scene.
fn camera(x: f64) -> ViewCamera {
    ViewCamera::looking_at(DVec3::new(x, 1.6, 5.0), DVec3::Y, 0.7, 0.01)
}

impl Bench {
    fn new(gpu: &gpu::Session) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let mut session = new_session(gpu, NeedsMode::Auto, None);
        furnish(&mut session, &model::write(folder.path()));
        // Built, compacted and at rest.
        for _ in 0..8 {
            frame(&mut session, SMALL);
        }
        let policy = AccelPolicy::of(&session.device_profile().profile, false);
        let refit = if policy.refit_tlas { TlasWork::Refit } else { TlasWork::Built };
        let blas_count = session.statistics().acceleration.blas_count;
        let steps = session.history().undo_count();
        Self { session, refit, blas_count, steps }
    }

    /// Renders a frame after a change and says what it did.
    fn after(&mut self, change: impl FnOnce(&mut Session)) -> Cost {
        let before = self.session.statistics().resets;
        change(&mut self.session);
        frame(&mut self.session, SMALL);
        let figures = self.session.statistics().clone();
        let structures = &figures.acceleration;
        let known = std::mem::replace(&mut self.blas_count, structures.blas_count);
        Cost {
            blas: structures.blas_built + structures.blas_refit,
            new_blas: structures.blas_count.saturating_sub(known),
            tlas: structures.tlas,
            bytes: figures.uploaded_bytes,
            resets: figures.resets - before,
            samples: figures.samples,
        }
    }

    fn edit(&mut self, edit: Edit) -> Cost {
        self.after(|session| session.push(edit).expect("an edit"))
    }

    /// A reset, and nothing built.
    #[track_caller]
    fn assert_reset(&self, cost: Cost, tlas: TlasWork, bytes: u64, reason: &str) {
        assert_eq!((cost.blas, cost.tlas), (0, tlas), "{reason}");
        assert!(cost.bytes < bytes, "{reason}: {} bytes", cost.bytes);
        // The first frame is a sample: nothing is denoised here.
        assert!(cost.resets > 0 && cost.samples == 1, "{reason}: {cost:?}");
        assert_eq!(self.session.statistics().reset_reason, reason);
    }

    /// Nothing at all.
    #[track_caller]
    fn assert_kept(&mut self, what: &str, change: impl FnOnce(&mut Session)) {
        let samples = self.session.samples();
        let cost = self.after(change);
        assert_eq!((cost.blas, cost.tlas, cost.resets), (0, TlasWork::Kept, 0), "{what}");
        assert_eq!(cost.samples, samples + 1, "{what}");
        assert!(cost.bytes < IDLE_BYTES, "{what}: {} bytes", cost.bytes);
    }

    /// Takes back what was done since the session was made, and lets it come to rest.
    fn back(&mut self) {
        while self.session.history().undo_count() > self.steps {
            self.session.undo();
        }
        self.session.set_time(None);
        self.session.set_settings(settings(Pipeline::Hybrid, NeedsMode::Auto));
        self.session.set_camera(camera(0.4));
        for _ in 0..4 {
            frame(&mut self.session, SMALL);
        }
        self.blas_count = self.session.statistics().acceleration.blas_count;
    }

    fn named(&self, name: &str) -> NodeId {
        self.session.document().nodes().find(|(_, node)| node.name == name).expect("a node").0
    }

    fn instance(&self) -> NodeId {
        self.session.document().nodes().find(|(_, node)| node.prefab().is_some()).expect("an instance").0
    }
}

fn at(x: f64) -> Local {
    Trs::from_translation(DVec3::new(x, 0.4, 0.3)).into()
}

fn what_moves_or_hides_costs_its_records_and_a_refit(bench: &mut Bench) {
    let instance = Target::node(bench.instance());
    let cost = bench.edit(Edit::SetTransform { target: instance, local: at(0.3) });
    bench.assert_reset(cost, bench.refit, FEW_BYTES, "moved model");
    let cost = bench.edit(Edit::SetVisible { target: instance, visible: false });
    bench.assert_reset(cost, bench.refit, FEW_BYTES, "hid model");
    let cost = bench.after(|session| _ = session.undo());
    bench.assert_reset(cost, bench.refit, FEW_BYTES, "showed model");
    let rays = Edit::SetRayVisibility {
        target: Target::node(bench.named("Floor")),
        camera_visible: true,
        casts_shadows: false,
    };
    let cost = bench.edit(rays);
    bench.assert_reset(cost, bench.refit, FEW_BYTES, "changed the ray visibility of Floor");
    // Nothing is left of a size of 0: an active state changes, and so the TLAS is built anew.
    let none = Trs { scale: DVec3::ZERO, ..Trs::default() }.into();
    let cost = bench.edit(Edit::SetTransform { target: Target::node(bench.named("Floor")), local: none });
    bench.assert_reset(cost, TlasWork::Built, FEW_BYTES, "moved Floor");
}

fn a_primitive_a_weight_and_a_joint_cost_the_trees_that_they_bend(bench: &mut Bench) {
    let instance = bench.instance();
    let part = |document: &Document, name: &str| {
        let prefab = document.prefab(document.node(instance)?.prefab()?)?;
        let place = prefab.nodes().iter().position(|part| part.name == name)?;
        Some(Target::part(instance, place as u32))
    };
    let [pair, flag, knee] =
        ["Pair", "Flag", "Knee"].map(|name| part(bench.session.document(), name).expect("a part"));
    let mesh = bench.session.document().mesh_of(pair).expect("a mesh");
    let mesh_from_primitive = glam::DAffine3::from_translation(DVec3::Y * 0.1);
    let shaped = Edit::SetMorphWeights { target: flag, weights: vec![0.5, 0.5] };
    let edits = [
        (
            Edit::SetPrimitiveTransform { mesh, primitive: 1, mesh_from_primitive },
            "moved primitive 1 of Pair",
        ),
        (shaped, "shaped Flag"),
        (Edit::SetTransform { target: knee, local: at(0.2) }, "moved Knee"),
    ];
    for (edit, reason) in edits {
        let cost = bench.edit(edit);
        assert_eq!((cost.blas, cost.new_blas, cost.tlas), (1, 0, bench.refit), "{reason}");
        assert!(cost.bytes < FEW_BYTES, "{reason}: {} bytes", cost.bytes);
        assert_eq!((cost.samples, bench.session.statistics().reset_reason.as_str()), (1, reason));
    }
}

fn an_instance_builds_what_it_does_not_share_and_its_end_builds_nothing(bench: &mut Bench) {
    let prefab = bench.session.document().prefabs().next().expect("a prefab").0;
    let make = |document: &mut Document| document.instantiate_edit(prefab, None, at(-1.0));
    let mut second = None;
    let cost = bench.after(|session| second = session.edit_with(make).ok());
    assert_eq!((cost.blas, cost.new_blas, cost.tlas), (DEFORMING, DEFORMING, TlasWork::Built));
    assert_eq!((cost.samples, bench.session.statistics().reset_reason.as_str()), (1, "added model"));
    let node = second.expect("an instance");
    let cost = bench.edit(Edit::RemoveNode { node });
    bench.assert_reset(cost, TlasWork::Built, FEW_BYTES, "removed model");
    let cost = bench.after(|session| _ = session.undo());
    assert_eq!((cost.blas, cost.new_blas, cost.tlas), (DEFORMING, DEFORMING, TlasWork::Built));
    // A rigid copy shares its tree with the one that it is a copy of.
    let floor = bench.named("Floor");
    let cost = bench.after(|session| {
        let copy = |document: &mut Document| document.duplicate_edit(floor).expect("a copy");
        session.edit_with(copy).expect("an edit");
    });
    bench.assert_reset(cost, TlasWork::Built, FEW_BYTES, "duplicated Floor");
}

fn materials_lights_and_surroundings_cost_their_records(bench: &mut Bench) {
    let (material, value) = bench
        .session
        .document()
        .materials()
        .next()
        .map(|(id, value)| (id, value.clone()))
        .expect("a material");
    let paint = Material { roughness: 0.7, ..value.clone() };
    let cost = bench.edit(Edit::SetMaterial { material, value: Box::new(paint) });
    bench.assert_reset(cost, TlasWork::Kept, FEW_BYTES, "changed Paint");
    let target = Target::node(bench.named("Lamp"));
    let light = bench.session.document().light_of(target).expect("a light");
    let light = Light { color: Vec3::new(1.0, 0.5, 0.5), ..light };
    let cost = bench.edit(Edit::SetLight { target, light });
    bench.assert_reset(cost, TlasWork::Kept, FEW_BYTES, "changed light Lamp");
    let cost = bench.edit(Edit::SetTransform { target, local: at(1.0) });
    bench.assert_reset(cost, TlasWork::Kept, FEW_BYTES, "moved Lamp");
    let surroundings = Environment::Constant(Vec3::splat(0.2));
    let cost = bench.edit(Edit::SetEnvironment(surroundings));
    bench.assert_reset(cost, TlasWork::Kept, FEW_BYTES, "changed the environment");
    // Light passes now: the pair has another tree, and so has the floor, which shared one with the plate.
    let glass = Material { transmission: 1.0, ..value };
    let cost = bench.edit(Edit::SetMaterial { material, value: Box::new(glass) });
    assert_eq!((cost.blas, cost.new_blas, cost.tlas), (2, 1, bench.refit));
}

fn material_named(bench: &Bench, name: &str) -> (MaterialId, Material) {
    let mut all = bench.session.document().materials();
    all.find(|(_, value)| value.name == name).map(|(id, value)| (id, value.clone())).expect("a material")
}

fn a_material_that_is_given_builds_a_tree_only_where_rays_pass(bench: &mut Bench) {
    let target = Target::node(bench.named("Floor"));
    let give = |bench: &mut Bench, name: &str| {
        let material = material_named(bench, name).0;
        bench.edit(Edit::AssignMaterial { target, primitive: 0, material })
    };
    let cost = give(bench, "Skin");
    bench.assert_reset(cost, bench.refit, FEW_BYTES, "gave Skin to Floor");
    // The floor leaves the tree that it shares with the plate; no instance has come, gone or moved.
    let cost = give(bench, "Glass");
    assert_eq!((cost.blas, cost.new_blas, cost.tlas, cost.samples), (1, 1, bench.refit, 1));
    let cost = give(bench, "Lace");
    bench.assert_reset(cost, bench.refit, FEW_BYTES, "gave Lace to Floor");
    let cost = give(bench, "Paint");
    bench.assert_reset(cost, bench.refit, FEW_BYTES, "gave Paint to Floor");
}

fn a_material_that_begins_to_shine_touches_no_tree(bench: &mut Bench) {
    let (material, dark) = material_named(bench, "Paint");
    let value = Box::new(Material { emissive: Vec3::splat(2.0), ..dark });
    let cost = bench.edit(Edit::SetMaterial { material, value });
    bench.assert_reset(cost, TlasWork::Kept, FEW_BYTES, "changed Paint");
    let cost = bench.after(|session| _ = session.undo());
    bench.assert_reset(cost, TlasWork::Kept, FEW_BYTES, "changed Paint");
}

fn a_time_step_costs_what_the_clip_moves_and_bends(bench: &mut Bench) {
    for time_s in [0.25, 0.5, 0.75] {
        let cost = bench.after(|session| session.set_time(Some(time_s)));
        assert_eq!((cost.blas, cost.new_blas, cost.tlas), (DEFORMING, 0, bench.refit), "at {time_s}");
        assert!(cost.bytes < FEW_BYTES, "{} bytes", cost.bytes);
        let figures = bench.session.statistics();
        assert_eq!((figures.samples, figures.reset_reason.as_str()), (1, "animation"));
    }
    bench.assert_kept("the same time", |session| session.set_time(Some(0.75)));
    let node = bench.instance();
    let cost = bench.edit(Edit::SetClip { node, clip: ClipChoice::None });
    assert_eq!((cost.blas, cost.tlas), (DEFORMING, bench.refit));
    bench.assert_kept("a time at which nothing plays", |session| session.set_time(Some(1.5)));
}

fn views_cost_no_structure(bench: &mut Bench) {
    let cost = bench.after(|session| session.set_camera(camera(0.5)));
    bench.assert_reset(cost, TlasWork::Kept, IDLE_BYTES, "camera");
    let change = |change: fn(&mut ViewSettings)| {
        move |session: &mut Session| {
            let mut settings = session.settings().clone();
            change(&mut settings);
            session.set_settings(settings);
        }
    };
    let cost = bench.after(change(|settings| settings.max_depth = 3));
    bench.assert_reset(cost, TlasWork::Kept, IDLE_BYTES, "render settings");
    let cost = bench.after(change(|settings| settings.pipeline = Pipeline::Raytraced));
    bench.assert_reset(cost, TlasWork::Kept, IDLE_BYTES, "pipeline");
    let smaller = [SMALL[0] - 8, SMALL[1] - 8];
    frame(&mut bench.session, smaller);
    let figures = bench.session.statistics();
    assert_eq!((figures.samples, figures.reset_reason.as_str()), (1, "size of the view"));
    assert_eq!(figures.acceleration.tlas, TlasWork::Kept);
    let cost = bench.after(|_| {});
    bench.assert_reset(cost, TlasWork::Kept, IDLE_BYTES, "size of the view");
    // Far out everything is sent anew against another origin. No tree of a mesh is touched; that of the instances is built,
    // because all of them have moved far.
    let cost = bench.after(|session| session.set_camera(camera(1e7)));
    bench.assert_reset(cost, TlasWork::Built, 4 * FEW_BYTES, "render origin");
}

fn what_is_no_event_keeps_the_samples(bench: &mut Bench) {
    let change = |change: fn(&mut ViewSettings)| {
        move |session: &mut Session| {
            let mut settings = session.settings().clone();
            change(&mut settings);
            session.set_settings(settings);
        }
    };
    bench.assert_kept("nothing, as when the window moves", |_| {});
    bench.assert_kept("the same camera", |session| session.set_camera(*session.camera()));
    bench.assert_kept("exposure", change(|settings| settings.exposure_ev = 1.5));
    bench.assert_kept("tone map", change(|settings| settings.tone_map = ToneMap::Agx));
    bench.assert_kept("what is shown", change(|settings| settings.show = Show::Normal));
    bench.assert_kept("needs", change(|settings| settings.needs = NeedsMode::All));
    let selection: BTreeSet<Target> = [Target::node(bench.instance())].into();
    bench.assert_kept("selection", |session| session.set_selection(&selection));
    bench.assert_kept("no selection", |session| session.set_selection(&BTreeSet::new()));
    let target = Target::node(bench.instance());
    let rename = Edit::Rename { target, name: String::from("Other") };
    bench.assert_kept("another name", |session| session.push(rename).expect("a name"));
    let group = |document: &mut Document| {
        document.add_edit(caustica_scene::Node::new("empty", NodeKind::Group), None)
    };
    bench.assert_kept("an empty group", |session| _ = session.edit_with(group).expect("a group"));
    let samples = bench.session.samples();
    let recorder = bench.session.begin_ui_frame().expect("a frame of the panels alone");
    bench.session.submit(recorder, None).expect("a submission");
    assert_eq!(bench.session.samples(), samples);
}

/// Mean length of the history, as the picture of it shows it.
fn history(session: &mut Session) -> f32 {
    let picture = session.read_display().expect("an image");
    picture.iter().map(|pixel| pixel[0]).sum::<f32>() / picture.len() as f32
}

fn history_is_reprojected_by_moves_and_dropped_with_everything(bench: &mut Bench) {
    let shown =
        ViewSettings { temporal: true, show: Show::History, ..settings(Pipeline::Hybrid, NeedsMode::Auto) };
    bench.session.set_settings(shown.clone());
    frame(&mut bench.session, SMALL);
    let step = |bench: &mut Bench, what: &str, number: u32| {
        let shift = f64::from(number) * 0.01;
        let target = Target::node(bench.named("Lamp"));
        let cost = bench.after(|session| match what {
            "time" => session.set_time(Some(shift)),
            "camera" => {
                session.set_camera(camera(0.5 + shift));
            }
            _ => session.push(Edit::SetTransform { target, local: at(2.0 + shift) }).expect("a place"),
        });
        assert_eq!(cost.samples, 0, "{what}: what moves is denoised, not accumulated");
        history(&mut bench.session)
    };
    for what in ["time", "camera", "light"] {
        let first = step(bench, what, 1);
        let later = (2..10).map(|number| step(bench, what, number)).last().expect("a length");
        assert!(later > 1.5 * first.max(1e-3) || first > 0.2, "{what}: {first}, then {later}");
        let kept = step(bench, what, 11);
        assert!(kept > 0.9 * later, "{what}: {later}, then {kept}");
        // Everything starts again: the next moving frame has no past.
        bench.session.set_settings(ViewSettings { max_depth: 3, ..shown.clone() });
        frame(&mut bench.session, SMALL);
        bench.session.set_settings(shown.clone());
        frame(&mut bench.session, SMALL);
        let dropped = step(bench, what, 12);
        assert!(dropped < 0.5 * kept, "{what}: {kept}, then {dropped}");
    }
}

/// All rows share one session, because making its pipelines takes most of the time; each leaves the scene as it was.
#[test]
fn each_event_costs_what_the_table_says() {
    let gpu = gpu::session();
    let mut bench = Bench::new(&gpu);
    for row in [
        what_moves_or_hides_costs_its_records_and_a_refit,
        a_primitive_a_weight_and_a_joint_cost_the_trees_that_they_bend,
        an_instance_builds_what_it_does_not_share_and_its_end_builds_nothing,
        materials_lights_and_surroundings_cost_their_records,
        a_material_that_is_given_builds_a_tree_only_where_rays_pass,
        a_material_that_begins_to_shine_touches_no_tree,
        a_time_step_costs_what_the_clip_moves_and_bends,
        what_is_no_event_keeps_the_samples,
        views_cost_no_structure,
        history_is_reprojected_by_moves_and_dropped_with_everything,
    ] {
        row(&mut bench);
        bench.back();
    }
}
