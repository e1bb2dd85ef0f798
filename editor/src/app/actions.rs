//! Everything the user can ask for by a menu, a key, a button or the command palette. Enters: keys. Leaves: actions
//! with their names, icons and shortcuts, each written once. It carries nothing out.

use std::path::PathBuf;

use caustica_renderer::{Pipeline, Show};
use caustica_scene::PrefabId;
use egui::{Key, KeyboardShortcut, Modifiers};
use egui_phosphor::regular as icon;

use crate::camera_control::AxisView;
use crate::gizmo::Tool;
use crate::ui_state::{HelpWindow, Tab};

/// A light that can be added.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NewLight {
    /// Shines to all sides.
    Point,
    /// Shines into a cone.
    Spot,
    /// Shines from afar.
    Sun,
}

/// Spheres and boxes that can be added.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NewShapes {
    /// A sphere.
    Sphere,
    /// A box.
    Box,
    /// Many of both.
    Cloud,
}

/// Something to do.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// Start an empty scene.
    New,
    /// Ask for a scene to open.
    Open,
    /// Open this file.
    OpenPath(PathBuf),
    /// Ask for a model to add.
    Import,
    /// Add this model.
    ImportPath(PathBuf),
    /// Save where it was saved before.
    Save,
    /// Ask where to save.
    SaveAs,
    /// Ask where to write the scene as glTF.
    Export,
    /// Look for unsaved changes that were left behind.
    Recover,
    /// End the program.
    Quit,
    /// Undo a step.
    Undo,
    /// Do it again.
    Redo,
    /// Copy what is selected.
    Duplicate,
    /// Remove what is selected.
    Delete,
    /// Type a new name for the active object.
    Rename,
    /// Show or hide what is selected.
    ToggleVisible,
    /// Keep what is selected from being changed, or let go of it.
    ToggleLock,
    /// Give the active instance a prefab of its own.
    MakeUnique,
    /// Read the source of a prefab again.
    ReloadSource(PrefabId),
    /// Ask for another source of a prefab.
    ReplaceSource(PrefabId),
    /// Select every object at the top.
    SelectAll,
    /// Select nothing.
    SelectNone,
    /// Put what is selected into a new group.
    Group,
    /// Add an empty group.
    AddGroup,
    /// Add a light.
    AddLight(NewLight),
    /// Add spheres and boxes.
    AddShapes(NewShapes),
    /// Add a camera that sees what the view sees.
    AddCamera,
    /// Place a prefab once more.
    AddInstance(PrefabId),
    /// Bring the selection into the picture.
    FrameSelection,
    /// Bring everything into the picture.
    FrameAll,
    /// Look along an axis.
    AxisView(AxisView),
    /// Look through the scene's camera.
    SceneCamera,
    /// Put the scene's camera where the view is.
    CameraFromView,
    /// Between perspective and parallel projection.
    ToggleProjection,
    /// Between dark and light.
    ToggleTheme,
    /// Show this panel.
    ShowTab(Tab),
    /// All panels back to their places.
    ResetLayout,
    /// Make pictures this way.
    Pipeline(Pipeline),
    /// Show this target.
    Show(Show),
    /// Ask for an environment image.
    Environment,
    /// Ask for a picture to compare with.
    OpenReference,
    /// Measure FLIP of the picture as it is, against the reference.
    MeasureFlip,
    /// Surround the scene with this image.
    EnvironmentPath(PathBuf),
    /// Lower the resolution while something moves, or not.
    ToggleAdaptive,
    /// What a drag does.
    Tool(Tool),
    /// World or local axes.
    ToggleSpace,
    /// Steps or not.
    ToggleSnap,
    /// Let the animation play, or pause it.
    PlayPause,
    /// Show the beginning of the animation.
    ToStart,
    /// Show the frame before.
    StepBack,
    /// Show the next frame.
    StepForward,
    /// Begin again at the end, or stop there.
    ToggleLoop,
    /// Show the scene without any clip.
    RestPose,
    /// Save the shader that is being edited.
    SaveShader,
    /// Write the shaders into the user's folder, to edit them there.
    EditShaders,
    /// Open the command palette.
    Palette,
    /// Open a window of the Help menu.
    Help(HelpWindow),
}

/// The menus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Menu {
    /// Files.
    File,
    /// Undo and objects.
    Edit,
    /// New objects.
    Add,
    /// Camera and panels.
    View,
    /// Settings of the picture.
    Render,
    /// Time.
    Animation,
    /// The tool bar.
    Tool,
    /// Help.
    Help,
}

/// An action with how it is shown and reached.
#[derive(Clone, Debug)]
pub struct Command {
    /// What it does.
    pub action: Action,
    /// Where it is.
    pub menu: Menu,
    /// How it is called.
    pub name: String,
    /// Its icon; empty: none.
    pub icon: &'static str,
    /// Its key.
    pub shortcut: Option<KeyboardShortcut>,
}

const CTRL: Modifiers = Modifiers::COMMAND;
const CTRL_SHIFT: Modifiers = Modifiers::COMMAND.plus(Modifiers::SHIFT);
const PLAIN: Modifiers = Modifiers::NONE;

fn command(
    menu: Menu,
    icon: &'static str,
    name: &str,
    action: Action,
    key: Option<(Modifiers, Key)>,
) -> Command {
    let shortcut = key.map(|(modifiers, key)| KeyboardShortcut::new(modifiers, key));
    Command { action, menu, name: name.to_owned(), icon, shortcut }
}

/// Every command with a fixed name, in the order of the menus.
pub fn commands() -> Vec<Command> {
    [file(), edit(), add(), view(), render(), animation(), tools(), help()].concat()
}

fn file() -> Vec<Command> {
    let file = |icon, name, action, key| command(Menu::File, icon, name, action, key);
    vec![
        file(icon::FILE_PLUS, "New scene", Action::New, Some((CTRL, Key::N))),
        file(icon::FOLDER_OPEN, "Open\u{2026}", Action::Open, Some((CTRL, Key::O))),
        file(icon::DOWNLOAD_SIMPLE, "Import\u{2026}", Action::Import, Some((CTRL, Key::I))),
        file(icon::FLOPPY_DISK, "Save", Action::Save, Some((CTRL, Key::S))),
        file(icon::FLOPPY_DISK_BACK, "Save as\u{2026}", Action::SaveAs, Some((CTRL_SHIFT, Key::S))),
        file(icon::EXPORT, "Export\u{2026}", Action::Export, Some((CTRL, Key::E))),
        file(icon::CLOCK_COUNTER_CLOCKWISE, "Recover unsaved changes\u{2026}", Action::Recover, None),
        file(icon::SIGN_OUT, "Quit", Action::Quit, Some((CTRL, Key::Q))),
    ]
}

fn edit() -> Vec<Command> {
    let edit = |icon, name, action, key| command(Menu::Edit, icon, name, action, key);
    vec![
        edit(icon::ARROW_U_UP_LEFT, "Undo", Action::Undo, Some((CTRL, Key::Z))),
        edit(icon::ARROW_U_UP_RIGHT, "Redo", Action::Redo, Some((CTRL_SHIFT, Key::Z))),
        edit(icon::COPY, "Duplicate", Action::Duplicate, Some((CTRL, Key::D))),
        edit(icon::TRASH, "Delete", Action::Delete, Some((PLAIN, Key::Delete))),
        edit(icon::PENCIL_SIMPLE, "Rename", Action::Rename, Some((PLAIN, Key::F2))),
        edit(icon::EYE, "Show or hide", Action::ToggleVisible, Some((PLAIN, Key::H))),
        edit(icon::LOCK_SIMPLE, "Lock or unlock", Action::ToggleLock, Some((CTRL, Key::L))),
        edit(icon::FOLDER_SIMPLE_PLUS, "Group", Action::Group, Some((CTRL, Key::G))),
        edit(icon::PACKAGE, "Make instance unique", Action::MakeUnique, None),
        edit(icon::SELECTION_ALL, "Select all", Action::SelectAll, Some((CTRL, Key::A))),
        edit(icon::SELECTION, "Select nothing", Action::SelectNone, Some((CTRL_SHIFT, Key::A))),
    ]
}

fn add() -> Vec<Command> {
    let add = |icon, name, action| command(Menu::Add, icon, name, action, None);
    vec![
        add(icon::FOLDER_SIMPLE, "Add group", Action::AddGroup),
        add(icon::SPHERE, "Add sphere", Action::AddShapes(NewShapes::Sphere)),
        add(icon::CUBE, "Add box", Action::AddShapes(NewShapes::Box)),
        add(icon::DOTS_NINE, "Add cloud of spheres and boxes", Action::AddShapes(NewShapes::Cloud)),
        add(icon::LIGHTBULB, "Add point light", Action::AddLight(NewLight::Point)),
        add(icon::FLASHLIGHT, "Add spot light", Action::AddLight(NewLight::Spot)),
        add(icon::SUN, "Add sun", Action::AddLight(NewLight::Sun)),
        add(icon::VIDEO_CAMERA, "Add camera here", Action::AddCamera),
    ]
}

fn view() -> Vec<Command> {
    let view = |icon, name, action, key| command(Menu::View, icon, name, action, key);
    let axis = |name, axis, modifiers, key| view("", name, Action::AxisView(axis), Some((modifiers, key)));
    let mut commands = vec![
        view(icon::CROSSHAIR, "Frame selection", Action::FrameSelection, Some((PLAIN, Key::F))),
        view(icon::FRAME_CORNERS, "Frame everything", Action::FrameAll, Some((PLAIN, Key::Home))),
        view(icon::VIDEO_CAMERA, "Look through the camera", Action::SceneCamera, Some((PLAIN, Key::Num0))),
        view(icon::APERTURE, "Put the camera here", Action::CameraFromView, Some((CTRL, Key::Num0))),
        axis("Front", AxisView::Front, PLAIN, Key::Num1),
        axis("Back", AxisView::Back, CTRL, Key::Num1),
        axis("Right", AxisView::Right, PLAIN, Key::Num3),
        axis("Left", AxisView::Left, CTRL, Key::Num3),
        axis("Top", AxisView::Top, PLAIN, Key::Num7),
        axis("Bottom", AxisView::Bottom, CTRL, Key::Num7),
        view(
            icon::PERSPECTIVE,
            "Perspective or parallel",
            Action::ToggleProjection,
            Some((PLAIN, Key::Num5)),
        ),
        view(icon::CIRCLE_HALF, "Dark or light theme", Action::ToggleTheme, None),
        view(icon::LAYOUT, "Reset the layout", Action::ResetLayout, None),
    ];
    commands.extend(
        Tab::ALL.map(|tab| {
            command(Menu::View, "", &format!("Panel: {}", tab.name()), Action::ShowTab(tab), None)
        }),
    );
    commands
}

fn render() -> Vec<Command> {
    let render = |icon, name: &str, action| command(Menu::Render, icon, name, action, None);
    let mut commands = vec![
        render(icon::GLOBE_HEMISPHERE_WEST, "Environment image\u{2026}", Action::Environment),
        render(icon::TARGET, "Compare with an image\u{2026}", Action::OpenReference),
        render(icon::GAUGE, "Lower resolution while moving", Action::ToggleAdaptive),
    ];
    commands.extend(
        Pipeline::ALL.map(|pipeline| {
            render("", &format!("Pipeline: {}", pipeline.name()), Action::Pipeline(pipeline))
        }),
    );
    commands.extend(Show::ALL.map(|(show, name)| render("", &format!("Show: {name}"), Action::Show(show))));
    commands
}

fn animation() -> Vec<Command> {
    let time = |icon, name, action, key| command(Menu::Animation, icon, name, action, key);
    const ALT: Modifiers = Modifiers::ALT;
    vec![
        time(icon::SKIP_BACK, "To the start", Action::ToStart, Some((ALT, Key::Home))),
        time(icon::CARET_LINE_LEFT, "One frame back", Action::StepBack, Some((ALT, Key::ArrowLeft))),
        time(icon::PLAY, "Play or pause", Action::PlayPause, Some((PLAIN, Key::Space))),
        time(icon::CARET_LINE_RIGHT, "One frame on", Action::StepForward, Some((ALT, Key::ArrowRight))),
        time(icon::REPEAT, "Loop", Action::ToggleLoop, None),
        time(icon::STOP, "Rest pose", Action::RestPose, Some((Modifiers::SHIFT, Key::Space))),
    ]
}

fn tools() -> Vec<Command> {
    let tool = |icon, name, action, key| command(Menu::Tool, icon, name, action, Some((PLAIN, key)));
    vec![
        tool(icon::CURSOR, "Select", Action::Tool(Tool::Select), Key::Q),
        tool(icon::ARROWS_OUT_CARDINAL, "Move", Action::Tool(Tool::Move), Key::G),
        tool(icon::ARROWS_CLOCKWISE, "Rotate", Action::Tool(Tool::Rotate), Key::R),
        tool(icon::RESIZE, "Scale", Action::Tool(Tool::Scale), Key::S),
        tool(icon::GLOBE_SIMPLE, "World or local axes", Action::ToggleSpace, Key::L),
        tool(icon::MAGNET, "Snap", Action::ToggleSnap, Key::N),
    ]
}

fn help() -> Vec<Command> {
    let help = |icon, name, action, key| command(Menu::Help, icon, name, action, key);
    vec![
        help(icon::COMMAND, "Command palette", Action::Palette, Some((CTRL, Key::P))),
        help(icon::KEYBOARD, "Keys and mouse", Action::Help(HelpWindow::Shortcuts), Some((PLAIN, Key::F1))),
        help(icon::INFO, "About Caustica", Action::Help(HelpWindow::About), None),
    ]
}

/// Text that was typed after the key that opened the command palette, in the same frame: a slow frame loses nothing.
pub fn typed_after_palette_key(context: &egui::Context) -> String {
    let opens = |event: &egui::Event| {
        matches!(event, egui::Event::Key { key: Key::P, pressed: true, modifiers, .. } if modifiers.command)
            || matches!(event, egui::Event::Key { key: Key::F3, pressed: true, .. })
    };
    context.input(|input| {
        let after = input.events.iter().skip_while(|event| !opens(event)).skip(1);
        after
            .filter_map(|event| if let egui::Event::Text(text) = event { Some(text.as_str()) } else { None })
            .collect()
    })
}

/// Second keys of some commands.
fn aliases() -> [(Modifiers, Key, Action); 5] {
    [
        (CTRL, Key::Y, Action::Redo),
        (PLAIN, Key::X, Action::Delete),
        (PLAIN, Key::F3, Action::Palette),
        (PLAIN, Key::Period, Action::FrameSelection),
        (CTRL.plus(Modifiers::ALT), Key::Num0, Action::CameraFromView),
    ]
}

/// Keys that a text field needs for itself.
fn belongs_to_text(modifiers: Modifiers, key: Key) -> bool {
    let function_key = matches!(key, Key::F1 | Key::F2 | Key::F3);
    let editing = matches!(key, Key::Z | Key::Y | Key::A | Key::D);
    !(function_key || (modifiers.command && !editing))
}

/// The actions whose keys were pressed. `typing`: a text field has the keyboard.
pub fn pressed(context: &egui::Context, typing: bool) -> Vec<Action> {
    let keys: Vec<(Modifiers, Key)> = context.input(|input| {
        let pressed = |event: &egui::Event| match event {
            egui::Event::Key { key, pressed: true, repeat: false, modifiers, .. } => Some((*modifiers, *key)),
            _ => None,
        };
        input.events.iter().filter_map(pressed).collect()
    });
    if keys.is_empty() {
        return Vec::new();
    }
    let commands = commands();
    let matching = |(modifiers, key): (Modifiers, Key)| {
        // Space presses the button that has the keyboard.
        let presses = key == Key::Space && context.memory(|memory| memory.focused().is_some());
        if typing && belongs_to_text(modifiers, key) || presses {
            return None;
        }
        let known = commands.iter().filter_map(|c| Some((c.shortcut?, &c.action)));
        let found = known
            .into_iter()
            .find(|(shortcut, _)| shortcut.logical_key == key && modifiers.matches_exact(shortcut.modifiers));
        let alias = || aliases().into_iter().find(|(m, k, _)| *k == key && modifiers.matches_exact(*m));
        found.map(|(_, action)| action.clone()).or_else(|| alias().map(|(_, _, action)| action))
    };
    keys.into_iter().filter_map(matching).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_commands_share_a_key_or_a_name() {
        let commands = commands();
        let keys: Vec<_> = commands
            .iter()
            .filter_map(|c| c.shortcut.map(|s| (s.modifiers, s.logical_key)))
            .chain(aliases().into_iter().map(|(modifiers, key, _)| (modifiers, key)))
            .collect();
        for (i, key) in keys.iter().enumerate() {
            assert!(!keys[..i].contains(key), "{key:?} is taken twice");
        }
        for (i, command) in commands.iter().enumerate() {
            assert!(commands[..i].iter().all(|other| other.name != command.name), "{}", command.name);
        }
    }

    #[test]
    fn keys_become_actions_but_not_while_typing() {
        let context = egui::Context::default();
        let ask = |(modifiers, key): (Modifiers, Key), typing| {
            let mut actions = Vec::new();
            let event =
                |pressed| egui::Event::Key { key, physical_key: None, pressed, repeat: false, modifiers };
            let input =
                egui::RawInput { events: vec![event(true), event(false)], ..egui::RawInput::default() };
            context.run_ui(input, |ui| actions = pressed(ui.ctx(), typing)).drop_without_applying_deltas();
            actions
        };
        let ctrl = Modifiers { ctrl: true, command: true, ..Modifiers::NONE };
        assert_eq!(ask((ctrl, Key::Z), false), [Action::Undo]);
        assert_eq!(ask((ctrl.plus(Modifiers::SHIFT), Key::Z), false), [Action::Redo]);
        assert_eq!(ask((ctrl, Key::Y), false), [Action::Redo]);
        assert_eq!(ask((PLAIN, Key::G), false), [Action::Tool(Tool::Move)]);
        assert_eq!(ask((PLAIN, Key::G), true), []);
        assert_eq!(ask((PLAIN, Key::Space), false), [Action::PlayPause]);
        assert_eq!(ask((PLAIN, Key::Space), true), []);
        assert_eq!(ask((Modifiers::SHIFT, Key::Space), false), [Action::RestPose]);
        assert_eq!(ask((Modifiers::ALT, Key::ArrowRight), true), []);
        assert_eq!(ask((ctrl, Key::Z), true), []);
        assert_eq!(ask((ctrl, Key::S), true), [Action::Save]);
    }
}
