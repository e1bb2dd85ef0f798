//! Carries out actions. Enters: an action. Leaves: edits pushed to the session, a moved camera, changed memory.

use std::collections::BTreeSet;

use caustica_scene::{
    Camera, Cloud, Edit, Environment, Light, LightKind, Local, Node, NodeId, NodeKind, PrefabId, Projection,
    ShapeSource, Target, Trs,
};
use glam::{DQuat, DVec3, Vec3};

use super::actions::{Action, NewLight, NewShapes};
use super::editor::{Editor, Then};
use super::files::Purpose;
use crate::camera_control::{AxisView, Pose, framing_projection};
use crate::dialogs::Wish;
use crate::gizmo::Space;
use crate::panels::{Cx, outliner, view_input};
use crate::playback;
use crate::session::ViewCamera;
use crate::ui_state::PaletteState;

impl Editor {
    /// Carries out one action.
    pub fn perform(&mut self, action: Action) {
        self.session.end_gesture();
        match action {
            Action::New => self.guarded(Then::New),
            Action::Open => self.guarded(Then::AskAndOpen),
            Action::OpenPath(path) => self.guarded(Then::Open(path)),
            Action::Import => self.ask(Wish::Import),
            Action::ImportPath(path) | Action::EnvironmentPath(path) => self.load(Purpose::Import, path),
            Action::Save => self.save(),
            Action::SaveAs => self.ask(Wish::SaveAs),
            Action::Export => self.ask(Wish::Export),
            Action::Recover => self.guarded(Then::Recover),
            Action::Quit if !self.shaders_are_saved() => {}
            Action::Quit => self.guarded(Then::Quit),
            Action::SaveShader => self.save_shader(),
            Action::EditShaders => self.edit_shaders(),
            Action::Undo | Action::Redo => self.undo_or_redo(action == Action::Undo),
            Action::Duplicate => self.duplicate(),
            Action::Delete => self.delete(),
            Action::Rename => self.rename(),
            Action::ToggleVisible => self.toggle_visible(),
            Action::ToggleLock => self.toggle_lock(),
            Action::MakeUnique => self.make_unique(),
            Action::ReloadSource(prefab) => self.reload_source(prefab),
            Action::ReplaceSource(prefab) => self.ask(Wish::Source(prefab)),
            Action::SelectAll => {
                let roots: Vec<Target> =
                    self.session.document().roots().iter().copied().map(Target::node).collect();
                self.state.selection.set_all(roots);
            }
            Action::SelectNone => self.state.selection.clear(),
            Action::Group => self.group(),
            Action::AddGroup => self.add(Node::new("Group", NodeKind::Group)),
            Action::AddLight(kind) => self.add_light(kind),
            Action::AddShapes(shapes) => self.add_shapes(shapes),
            Action::AddCamera => self.add_camera(),
            Action::AddInstance(prefab) => self.add_instance(prefab),
            Action::FrameSelection | Action::FrameAll => self.frame(action == Action::FrameSelection),
            Action::AxisView(axis) => self.axis_view(axis),
            Action::SceneCamera => self.scene_camera(),
            Action::CameraFromView => self.camera_from_view(),
            Action::ToggleProjection => self.toggle_projection(),
            Action::Environment => self.ask(Wish::Environment),
            Action::OpenReference => self.ask(Wish::Reference),
            Action::MeasureFlip => {
                if let Err(error) = self.state.error.measure_flip(&mut self.session, self.wake.clone()) {
                    self.state.toasts.error(format!("FLIP was not measured: {error:#}"));
                }
            }
            Action::PlayPause
            | Action::ToStart
            | Action::StepBack
            | Action::StepForward
            | Action::ToggleLoop
            | Action::RestPose => self.animate(&action),
            other => self.perform_setting(other),
        }
    }

    /// Actions that change neither document nor camera.
    fn perform_setting(&mut self, action: Action) {
        let state = &mut self.state;
        match action {
            Action::ToggleTheme => state.config.dark = !state.config.dark,
            Action::ToggleAdaptive => state.config.adaptive = !state.config.adaptive,
            Action::Tool(tool) => state.tool = tool,
            Action::ToggleSpace => {
                state.space = if state.space == Space::World { Space::Local } else { Space::World };
            }
            Action::ToggleSnap => state.snap = !state.snap,
            Action::Palette => state.palette = Some(PaletteState::default()),
            Action::Help(window) => state.help = Some(window),
            Action::ShowTab(tab) => self.show_tab(tab),
            Action::ResetLayout => self.reset_layout(),
            Action::Pipeline(pipeline) => {
                let settings = self.session.settings().clone();
                self.session.set_settings(caustica_renderer::ViewSettings { pipeline, ..settings });
            }
            Action::Show(show) => {
                let settings = self.session.settings().clone();
                self.session.set_settings(caustica_renderer::ViewSettings { show, ..settings });
            }
            other => tracing::debug!("{other:?} is carried out elsewhere"),
        }
    }

    /// Actions on the time that is shown.
    fn animate(&mut self, action: &Action) {
        let Some(duration_s) = self.session.duration() else {
            self.state.toasts.info("Nothing here is animated, or no clip is chosen (Animation panel).");
            return;
        };
        let playback = &mut self.state.playback;
        let now_s = self.session.time().unwrap_or(0.0);
        let time_s = match action {
            Action::ToggleLoop => {
                playback.looping = !playback.looping;
                return;
            }
            Action::PlayPause if playback.playing => {
                playback.playing = false;
                return;
            }
            Action::PlayPause => Some(playback.start(now_s, duration_s)),
            Action::ToStart => Some(0.0),
            Action::StepBack | Action::StepForward => {
                playback.playing = false;
                let frames = if *action == Action::StepBack { -1.0 } else { 1.0 };
                Some(playback::step(now_s, duration_s, frames))
            }
            _ => {
                playback.playing = false;
                None
            }
        };
        self.session.set_time(time_s);
    }

    fn cx(&mut self) -> Cx<'_> {
        Cx { session: &mut self.session, state: &mut self.state }
    }

    fn undo_or_redo(&mut self, undo: bool) {
        let done = if undo { self.session.undo() } else { self.session.redo() };
        match done {
            Some(label) if undo => tracing::info!("undone: {label}"),
            Some(label) => tracing::info!("done again: {label}"),
            None => {}
        }
    }

    /// Selected nodes that hang below no other selected one; parts inside instances cannot be copied or removed.
    fn selected_nodes(&mut self) -> Vec<NodeId> {
        let tops = self.state.selection.tops(self.session.document());
        let nodes: Vec<NodeId> =
            tops.iter().filter(|target| target.part.is_none()).map(|target| target.node).collect();
        if nodes.is_empty() && !tops.is_empty() {
            self.state.toasts.warning(
                "A part inside an instance belongs to its file: hide it instead, or select the instance.",
            );
        }
        nodes
    }

    fn push_batch(&mut self, label: String, mut edits: Vec<Edit>) {
        match edits.len() {
            0 => {}
            1 => {
                let edit = edits.remove(0);
                self.cx().push(edit);
            }
            _ => self.cx().push(Edit::batch(label, edits)),
        }
    }

    fn duplicate(&mut self) {
        let nodes = self.selected_nodes();
        if nodes.is_empty() {
            return;
        }
        let made = self.session.edit_with(|document| {
            let copies: Vec<(NodeId, Edit)> =
                nodes.iter().filter_map(|&id| document.duplicate_edit(id).ok()).collect();
            let label = match nodes.as_slice() {
                [one] => format!("duplicated {}", document.display_name((*one).into())),
                _ => format!("duplicated {} objects", nodes.len()),
            };
            let (ids, edits): (Vec<_>, Vec<_>) = copies.into_iter().unzip();
            (ids, Edit::batch(label, edits))
        });
        match made {
            Ok(ids) => self.state.selection.set_all(ids.into_iter().map(Target::node)),
            Err(error) => self.state.toasts.error(format!("That cannot be duplicated: {error}.")),
        }
    }

    fn delete(&mut self) {
        let nodes = self.selected_nodes();
        let label = format!("removed {} objects", nodes.len());
        self.push_batch(label, nodes.into_iter().rev().map(|node| Edit::RemoveNode { node }).collect());
    }

    fn rename(&mut self) {
        if let Some(target) = self.state.selection.active() {
            outliner::start_renaming(&mut self.cx(), target);
        }
    }

    fn toggle_visible(&mut self) {
        let document = self.session.document();
        let targets = self.state.selection.targets();
        // One that is hidden shows all.
        let visible = targets.iter().any(|target| document.visible(*target) == Some(false));
        let edits = targets.iter().map(|&target| Edit::SetVisible { target, visible }).collect();
        let label = format!("{} {} objects", if visible { "showed" } else { "hid" }, targets.len());
        self.push_batch(label, edits);
    }

    fn toggle_lock(&mut self) {
        let document = self.session.document();
        let nodes: BTreeSet<NodeId> =
            self.state.selection.targets().iter().map(|target| target.node).collect();
        let is_locked = |node: &NodeId| document.node(*node).is_some_and(|node| node.locked);
        // One that is free locks all.
        let locked = !nodes.iter().all(is_locked);
        let label = format!("{} {} objects", if locked { "locked" } else { "unlocked" }, nodes.len());
        self.push_batch(label, nodes.into_iter().map(|node| Edit::SetLocked { node, locked }).collect());
    }

    fn make_unique(&mut self) {
        let Some(active) = self.state.selection.active() else { return };
        if let Err(error) = self.session.make_unique(active.node) {
            self.state.toasts.error(format!("That cannot be made unique: {error}."));
        }
    }

    fn group(&mut self) {
        let nodes = self.selected_nodes();
        let Some(first) = nodes.first().copied() else { return };
        let parent = self.session.document().node(first).and_then(|node| node.parent);
        let label = format!("grouped {} objects", nodes.len());
        let made = self.session.edit_with(|document| {
            let (group, add) = document.add_edit(Node::new("Group", NodeKind::Group), parent);
            // The group is at its parent's origin, so that its members keep their transforms when they share it.
            let world_from_parent = parent.and_then(|id| document.world_from(id.into())).unwrap_or_default();
            let parent_from_world = world_from_parent.inverse();
            let mut edits = vec![add];
            for &node in &nodes {
                let same_parent = document.node(node).is_some_and(|n| n.parent == parent);
                let local = match (same_parent, document.local(node.into()), document.world_from(node.into()))
                {
                    (true, Some(local), _) => local,
                    (_, _, Some(world)) => Local::from_affine(parent_from_world * world),
                    _ => continue,
                };
                edits.push(Edit::Reparent { node, parent: Some(group), index: usize::MAX, local });
            }
            (group, Edit::batch(label, edits))
        });
        match made {
            Ok(group) => self.selected_new(group),
            Err(error) => self.state.toasts.error(format!("That cannot be grouped: {error}.")),
        }
    }

    fn selected_new(&mut self, node: NodeId) {
        self.state.selection.set(node.into());
        self.state.outliner.reveal(self.session.document(), node.into());
    }

    fn add(&mut self, node: Node) {
        self.add_with(node, None);
    }

    /// Adds a node, together with another edit where one is needed, as one step.
    fn add_with(&mut self, node: Node, besides: Option<Edit>) {
        let name = self.free_name(&node.name);
        let made = self.session.edit_with(|document| {
            let (id, add) = document.add_edit(Node { name, ..node }, None);
            let edit = match besides {
                Some(besides) => Edit::batch(add.describe(document), vec![add, besides]),
                None => add,
            };
            (id, edit)
        });
        match made {
            Ok(id) => self.selected_new(id),
            Err(error) => self.state.toasts.error(format!("That cannot be added: {error}.")),
        }
    }

    /// The name, with a number behind it when it is taken.
    fn free_name(&self, name: &str) -> String {
        let taken: std::collections::BTreeSet<&str> =
            self.session.document().nodes().map(|(_, node)| node.name.as_str()).collect();
        let numbered = |n: u32| if n == 1 { name.to_owned() } else { format!("{name} {n}") };
        (1..).map(numbered).find(|name| !taken.contains(name.as_str())).unwrap_or_else(|| name.to_owned())
    }

    /// In front of the eye, where new things appear.
    fn place_in_view(&self) -> DVec3 {
        Pose::from_affine(&self.session.camera().world_from_camera).pivot(self.state.view.distance_m)
    }

    fn add_light(&mut self, kind: NewLight) {
        let at = self.place_in_view();
        let size = self.state.view.distance_m;
        let above = at + DVec3::Y * size * 0.4;
        let radius_m = (size * 0.02) as f32;
        // A white, rough surface in the middle of the picture comes out white: radiance = lux / pi.
        let lux = std::f64::consts::PI;
        let intensity = ((size * 0.4).powi(2) * lux).max(1e-6) as f32;
        let down = DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2);
        let (name, kind, intensity, trs) = match kind {
            NewLight::Point => {
                let kind = LightKind::Point { radius_m, range_m: None };
                ("Point light", kind, intensity, Trs::from_translation(above))
            }
            NewLight::Spot => {
                let kind = LightKind::Spot { radius_m, range_m: None, inner_rad: 0.35, outer_rad: 0.6 };
                ("Spot light", kind, intensity, Trs { rotation: down, ..Trs::from_translation(above) })
            }
            NewLight::Sun => {
                let kind = LightKind::Directional { angular_radius_rad: 0.00465 };
                let slanted = DQuat::from_rotation_y(0.7) * DQuat::from_rotation_x(-0.9);
                ("Sun", kind, lux as f32, Trs { rotation: slanted, ..Trs::from_translation(above) })
            }
        };
        let light = Light { color: Vec3::ONE, intensity, kind };
        let node = Node::new(name, NodeKind::Light(light)).with_local(trs);
        let document = self.session.document();
        // The automatic sky is there because nothing shines; the first light must not turn the rest black.
        let keeps_sky = document.environment() == &Environment::Auto
            && document.effective_environment() == Environment::DefaultSky;
        let sky = keeps_sky.then_some(Edit::SetEnvironment(Environment::DefaultSky));
        self.add_with(node, sky);
    }

    /// As large as is handy in the view, on no floor in particular.
    fn add_shapes(&mut self, shapes: NewShapes) {
        let at = self.place_in_view();
        let size = (self.state.view.distance_m * 0.15) as f32;
        let (name, source) = match shapes {
            NewShapes::Sphere => ("Sphere", ShapeSource::Sphere { centre: Vec3::ZERO, radius_m: size }),
            NewShapes::Box => {
                ("Box", ShapeSource::Box { centre: Vec3::ZERO, half_extent_m: Vec3::splat(size) })
            }
            NewShapes::Cloud => {
                let radius_m = [0.01 * size, 0.04 * size];
                let cloud = Cloud { half_extent_m: Vec3::splat(2.0 * size), radius_m, ..Cloud::default() };
                ("Cloud", ShapeSource::Cloud(cloud))
            }
        };
        let name = self.free_name(name);
        let trs = Trs::from_translation(at);
        let added = self.session.add_shapes(&name, source, trs.into());
        match added {
            Ok(id) => self.selected_new(id),
            Err(error) => self.state.toasts.error(format!("That cannot be added: {error}.")),
        }
    }

    fn add_camera(&mut self) {
        let view = *self.session.camera();
        let camera = Camera { projection: view.projection, near_m: view.near_m as f32, ..Camera::default() };
        let local = Local::from_affine(view.world_from_camera);
        self.add(Node::new("Camera", NodeKind::Camera(camera)).with_local(local));
    }

    fn add_instance(&mut self, prefab: PrefabId) {
        let at = self.place_in_view();
        let local = Local::Trs(Trs::from_translation(at));
        match self.session.edit_with(|document| document.instantiate_edit(prefab, None, local)) {
            Ok(id) => self.selected_new(id),
            Err(error) => self.state.toasts.error(format!("That cannot be placed: {error}.")),
        }
    }

    fn aspect(&self) -> f64 {
        self.state.view.extent_px.map_or(1.6, |[width, height]| f64::from(width) / f64::from(height.max(1)))
    }

    fn frame(&mut self, selection: bool) {
        let document = self.session.document();
        let selected = self.state.selection.targets().iter().filter_map(|target| {
            // Lights and cameras have no size of their own: some room around their place.
            let own = || {
                document.world_from(*target).map(|world| (world.translation - 0.25, world.translation + 0.25))
            };
            document.bounds_of(*target).or_else(own)
        });
        let join = |a: (DVec3, DVec3), b: (DVec3, DVec3)| (a.0.min(b.0), a.1.max(b.1));
        let bounds = if selection { selected.reduce(join) } else { None }.or_else(|| document.bounds());
        let Some(bounds) = bounds.filter(|(low, high)| low.is_finite() && high.is_finite()) else { return };
        let aspect = self.aspect();
        let camera = *self.session.camera();
        let projection = framing_projection(bounds, camera.projection, aspect);
        self.session.set_camera(ViewCamera { projection, ..camera });
        let (pose, distance) = Pose::from_affine(&camera.world_from_camera).frame(bounds, projection, aspect);
        self.state.view.distance_m = distance;
        self.state.view.fly_speed_m_s = ((bounds.1 - bounds.0).length() * 0.25).clamp(1e-3, 1e4);
        view_input::set_pose(&mut self.cx(), pose);
    }

    fn axis_view(&mut self, axis: AxisView) {
        let distance = self.state.view.distance_m;
        let pivot = Pose::from_affine(&self.session.camera().world_from_camera).pivot(distance);
        view_input::set_pose(&mut self.cx(), Pose::along_axis(axis, pivot, distance));
    }

    fn scene_camera(&mut self) {
        match self.session.document().main_camera() {
            Some(camera) => {
                self.session.set_camera(ViewCamera::of_placed(&camera));
                self.measure_scene();
            }
            None => self.state.toasts.info("The scene has no camera yet: Add > Add camera here."),
        }
    }

    fn camera_from_view(&mut self) {
        let Some(camera) = self.session.document().main_camera() else {
            self.add_camera();
            return;
        };
        let target = camera.target;
        let view = *self.session.camera();
        let world_from_parent = self.session.document().world_from_parent(target).unwrap_or_default();
        let local = Local::from_affine(world_from_parent.inverse() * view.world_from_camera);
        let label = format!("placed {}", self.session.document().display_name(target));
        let lens = Camera { projection: view.projection, ..camera.value };
        let edits = vec![Edit::SetTransform { target, local }, Edit::SetCamera { target, camera: lens }];
        self.push_batch(label, edits);
    }

    fn toggle_projection(&mut self) {
        let camera = *self.session.camera();
        let distance = self.state.view.distance_m;
        let projection = match camera.projection {
            Projection::Perspective { yfov_rad } => {
                Projection::Orthographic { ymag_m: (distance * (f64::from(yfov_rad) * 0.5).tan()) as f32 }
            }
            Projection::Orthographic { .. } => Projection::Perspective { yfov_rad: 0.7 },
        };
        self.session.set_camera(ViewCamera { projection, ..camera });
    }
}
