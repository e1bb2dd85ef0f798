//! What is kept between runs: theme, recent files, size of the window, where the panels are.
//! Enters and leaves: `caustica/layout.json` in the user's configuration folder. A bad file is told of and ignored.

use std::path::{Path, PathBuf};

use anyhow::Context as _;
use egui_dock::{DockState, NodeIndex};
use serde::{Deserialize, Serialize};

/// Most files in File > Open recent.
const MOST_RECENT: usize = 12;
/// Most projects that are trusted.
const MOST_TRUSTED: usize = 1000;

/// A panel that can be docked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Tab {
    /// The picture.
    View,
    /// The tree of the scene.
    Outliner,
    /// The selected object.
    Inspector,
    /// Environment and settings of the view.
    Render,
    /// Time, and the clips that are played.
    Animation,
    /// Noise and bias over run time.
    Error,
    /// Milliseconds of each pass.
    Passes,
    /// What is built, refitted and left alone.
    Acceleration,
    /// What this scene does not need.
    LeftOut,
    /// Findings of the audit.
    Health,
    /// The shaders, to be edited.
    Shaders,
    /// The log.
    Log,
}

impl Tab {
    /// Every panel, in the order of the menu.
    pub const ALL: [Self; 12] = [
        Self::View,
        Self::Outliner,
        Self::Inspector,
        Self::Render,
        Self::Animation,
        Self::Error,
        Self::Passes,
        Self::Acceleration,
        Self::LeftOut,
        Self::Health,
        Self::Shaders,
        Self::Log,
    ];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::View => "View",
            Self::Outliner => "Outliner",
            Self::Inspector => "Inspector",
            Self::Render => "Render",
            Self::Animation => "Animation",
            Self::Error => "Error",
            Self::Passes => "Passes",
            Self::Acceleration => "Acceleration",
            Self::LeftOut => "Left out",
            Self::Health => "Health",
            Self::Shaders => "Shaders",
            Self::Log => "Log",
        }
    }
}

/// The view in the middle, the tree to the left, the inspector to the right, reports below.
pub fn default_layout() -> DockState<Tab> {
    let mut dock = DockState::new(vec![Tab::View]);
    let tree = dock.main_surface_mut();
    let [rest, _right] = tree.split_right(NodeIndex::root(), 0.78, vec![Tab::Inspector, Tab::Render]);
    let [rest, _left] = tree.split_left(rest, 0.22, vec![Tab::Outliner]);
    let below = vec![
        Tab::Animation,
        Tab::Error,
        Tab::Passes,
        Tab::Acceleration,
        Tab::LeftOut,
        Tab::Health,
        Tab::Shaders,
        Tab::Log,
    ];
    let [_view, _below] = tree.split_below(rest, 0.76, below);
    dock
}

/// Puts a panel that is not there beside one that it stands with by default, else below everything. What is in front stays
/// there.
pub fn add_tab(dock: &mut DockState<Tab>, tab: Tab) {
    if dock.find_tab(&tab).is_some() {
        return;
    }
    let default = default_layout();
    let beside = |other: &Tab| {
        default.iter_leaves().any(|(_, leaf)| leaf.tabs.contains(&tab) && leaf.tabs.contains(other))
    };
    let leaf = dock.iter_leaves().find(|(_, leaf)| leaf.tabs.iter().any(beside)).map(|(path, _)| path);
    if let Some(Ok(leaf)) = leaf.map(|path| dock.leaf_mut(path)) {
        leaf.tabs.push(tab);
    } else {
        dock.main_surface_mut().split_below(NodeIndex::root(), 0.76, vec![tab]);
    }
}

/// What is kept between runs.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(default)]
pub struct Config {
    /// Dark or light.
    pub dark: bool,
    /// Files opened last, newest first.
    pub recent: Vec<PathBuf>,
    /// Projects that may read files outside of their folders: saved here, or allowed by the user.
    pub trusted: Vec<PathBuf>,
    /// Size of the window, points.
    pub window: [f32; 2],
    /// Frame time that the resolution follows while something moves.
    pub target_frame_ms: f32,
    /// Lower the resolution while something moves.
    pub adaptive: bool,
    /// Where the panels are.
    pub layout: Option<DockState<Tab>>,
    /// The panels that the version which wrote the file had: of those the missing ones were closed.
    #[serde(default)]
    pub known_tabs: Vec<Tab>,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            dark: true,
            recent: Vec::new(),
            trusted: Vec::new(),
            window: [1600.0, 960.0],
            target_frame_ms: 33.0,
            adaptive: true,
            layout: None,
            known_tabs: Tab::ALL.to_vec(),
        }
    }
}

impl Config {
    /// Reads what was kept; the defaults where nothing was, or when it cannot be read, which is told.
    pub fn load() -> Self {
        let Some(path) = path() else { return Self::default() };
        match std::fs::read_to_string(&path) {
            Ok(text) => Self::parse(&text).unwrap_or_else(|error| {
                tracing::warn!("{}: {error}; the default layout is used", path.display());
                Self::default()
            }),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Self::default(),
            Err(error) => {
                tracing::warn!("{}: {error}; the default layout is used", path.display());
                Self::default()
            }
        }
    }

    fn parse(text: &str) -> serde_json::Result<Self> {
        Self::of_json(serde_json::from_str(text)?)
    }

    /// Reads what [`serde_json`] made of one; odd values are mended.
    ///
    /// # Errors
    /// When it says something else.
    pub fn of_json(mut value: serde_json::Value) -> serde_json::Result<Self> {
        mend_places(&mut value);
        let mut config: Self = serde_json::from_value(value)?;
        // A layout without a view is of no use.
        config.layout = config.layout.filter(|dock| dock.iter_all_tabs().any(|(_, tab)| *tab == Tab::View));
        if let Some(dock) = &mut config.layout {
            let new = Tab::ALL.into_iter().filter(|tab| !config.known_tabs.contains(tab));
            new.for_each(|tab| add_tab(dock, tab));
        }
        config.known_tabs = Tab::ALL.to_vec();
        config.window =
            config.window.map(|side| if side.is_finite() { side.clamp(480.0, 16_384.0) } else { 960.0 });
        config.recent.truncate(MOST_RECENT);
        Ok(config)
    }

    /// Writes it, whole or not at all.
    ///
    /// # Errors
    /// With the file's name when it cannot be written.
    pub fn save(&self) -> anyhow::Result<()> {
        let Some(path) = path() else { return Ok(()) };
        let text = serde_json::to_string_pretty(self).context("writing the layout")?;
        let folder = path.parent().unwrap_or(Path::new("."));
        std::fs::create_dir_all(folder).with_context(|| format!("making {}", folder.display()))?;
        let beside = path.with_extension("json.new");
        std::fs::write(&beside, text).with_context(|| format!("writing {}", beside.display()))?;
        std::fs::rename(&beside, &path).with_context(|| format!("writing {}", path.display()))
    }

    /// Puts a file first among the recent ones.
    pub fn remember(&mut self, path: &Path) {
        put_first(&mut self.recent, path, MOST_RECENT);
    }

    /// Allows a project to read files outside of its folder.
    pub fn trust(&mut self, project: &Path) {
        put_first(&mut self.trusted, project, MOST_TRUSTED);
    }

    /// Whether a project may read files outside of its folder.
    pub fn trusts(&self, project: &Path) -> bool {
        std::path::absolute(project).is_ok_and(|project| self.trusted.contains(&project))
    }
}

fn put_first(list: &mut Vec<PathBuf>, path: &Path, most: usize) {
    let path = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
    list.retain(|known| *known != path);
    list.insert(0, path);
    list.truncate(most);
}

/// Panels that were never drawn are at infinity, which JSON writes as null: their places are put to zero.
fn mend_places(value: &mut serde_json::Value) {
    match value {
        serde_json::Value::Object(map) => {
            for (key, value) in map {
                if value.is_null() && matches!(key.as_str(), "x" | "y") {
                    *value = 0.0.into();
                }
                mend_places(value);
            }
        }
        serde_json::Value::Array(items) => items.iter_mut().for_each(mend_places),
        _ => {}
    }
}

fn path() -> Option<PathBuf> {
    let set = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    let folder = set("XDG_CONFIG_HOME").or_else(|| set("HOME").map(|home| home.join(".config")))?;
    Some(folder.join("caustica").join("layout.json"))
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

    use super::*;

    #[test]
    fn a_layout_survives_its_file() {
        let mut config = Config { layout: Some(default_layout()), dark: false, ..Config::default() };
        config.remember(Path::new("/scenes/a.glb"));
        let again = Config::parse(&serde_json::to_string(&config).unwrap()).unwrap();
        assert!(!again.dark);
        assert_eq!(again.recent, config.recent);
        let mut tabs: Vec<_> = again.layout.unwrap().iter_all_tabs().map(|(_, tab)| *tab).collect();
        tabs.sort();
        assert_eq!(tabs, Tab::ALL);
    }

    /// The layout in a file without some panels, read again; `known`: the file tells which panels its version had.
    fn read_without(gone: &[Tab], known: bool) -> DockState<Tab> {
        let mut layout = default_layout();
        layout.retain_tabs(|tab| !gone.contains(tab));
        let mut value = serde_json::to_value(Config { layout: Some(layout), ..Config::default() }).unwrap();
        if !known {
            value.as_object_mut().unwrap().remove("known_tabs");
        }
        Config::parse(&value.to_string()).unwrap().layout.unwrap()
    }

    #[test]
    fn panels_of_later_versions_come_into_an_old_layout_and_closed_ones_stay_closed() {
        let gone = [Tab::Animation, Tab::Acceleration];
        let layout = read_without(&gone, false);
        for tab in gone {
            let path = layout.find_tab(&tab).unwrap();
            let beside = layout.find_tab(&Tab::Passes).unwrap();
            assert_eq!((path.surface, path.node), (beside.surface, beside.node), "{}", tab.name());
        }
        let in_front: Vec<Tab> = layout.iter_leaves().map(|(_, leaf)| leaf.tabs[leaf.active.0]).collect();
        assert!(in_front.iter().all(|tab| !gone.contains(tab)), "{in_front:?}");
        let closed = read_without(&gone, true);
        assert!(gone.iter().all(|tab| closed.find_tab(tab).is_none()));
        // None of its neighbours is left: it stands by itself, and what there was is still seen.
        let below = [
            Tab::Animation,
            Tab::Passes,
            Tab::Acceleration,
            Tab::LeftOut,
            Tab::Health,
            Tab::Shaders,
            Tab::Log,
        ];
        let alone = read_without(&below, false);
        assert!(Tab::ALL.iter().all(|tab| alone.find_tab(tab).is_some()));
        let view = alone.find_tab(&Tab::View).unwrap();
        assert_eq!(alone.leaf(view.node_path()).unwrap().tabs, [Tab::View]);
    }

    #[test]
    fn nonsense_is_an_error_and_odd_values_are_mended() {
        assert!(Config::parse("{").is_err());
        assert!(Config::parse(r#"{"dark": "perhaps"}"#).is_err());
        let odd = Config::parse(r#"{"window": [1e9, -5.0], "unknown": 1}"#).unwrap();
        assert_eq!(odd.window, [16_384.0, 480.0]);
    }

    #[test]
    fn recent_files_are_few_and_unlike() {
        let mut config = Config::default();
        for n in 0..20 {
            config.remember(Path::new(&format!("/scenes/{n}.glb")));
        }
        config.remember(Path::new("/scenes/15.glb"));
        assert_eq!(config.recent.len(), MOST_RECENT);
        assert_eq!(config.recent[0], Path::new("/scenes/15.glb"));
        assert_eq!(config.recent.iter().filter(|path| path.ends_with("15.glb")).count(), 1);
    }
}
