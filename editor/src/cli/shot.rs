//! What is looked at, for `caustica render` and `report`: a file, a scene, variant, time, camera and environment of it, a size.
//! Enters: arguments. Leaves: a session that shows it.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use anyhow::{Context, bail};
use caustica_renderer::ViewSettings;
use caustica_scene::Edit;
use clap::Args;

use super::SourceArgs;
use crate::session::{Loaded, Session, ViewCamera, environment_argument};

/// What is looked at.
#[derive(Args, Debug)]
pub(super) struct ShotArgs {
    /// A project, .gltf, .glb or .obj
    pub(super) file: PathBuf,
    #[command(flatten)]
    pub(super) sources: SourceArgs,
    /// Size in pixels
    #[arg(long, value_name = "WxH", value_parser = parse_size, default_value = "1280x720")]
    pub(super) size: [u32; 2],
    /// Show the scene at this time of its animation; past the end of a clip it begins again. Without it: at rest
    #[arg(long, value_name = "SECONDS", value_parser = parse_seconds)]
    pub(super) at: Option<f64>,
    /// Name of the camera; the n-th of one name is NAME#n
    #[arg(long)]
    pub(super) camera: Option<String>,
    /// Show this scene of the file: its name, or its number from 1
    #[arg(long, value_name = "NAME|INDEX")]
    pub(super) scene: Option<String>,
    /// Show every instance that has it in this variant of materials (KHR_materials_variants)
    #[arg(long, value_name = "NAME")]
    pub(super) variant: Option<String>,
    /// An environment map (.hdr, .exr), or a constant radiance R,G,B
    #[arg(long, value_name = "FILE|R,G,B")]
    pub(super) environment: Option<String>,
}

impl ShotArgs {
    /// Reads the file. A mistake in the environment's argument is said too, before a device is opened.
    pub(super) fn load(&self, progress: &dyn Fn(&str, f32)) -> anyhow::Result<Loaded> {
        let loaded = self.sources.load(&self.file, progress)?;
        self.environment.as_deref().map(environment_argument).transpose()?;
        Ok(loaded)
    }

    /// Shows what was loaded.
    pub(super) fn open(&self, session: &mut Session, loaded: Loaded) -> anyhow::Result<()> {
        // What the file does not say is as at the start, whatever was shown before.
        session.set_settings(ViewSettings::default());
        session.open_at(&self.file, loaded, self.at)?;
        if self.at.is_some() && session.duration().is_none() {
            bail!(
                "{}: --at was given, but no clip of it is played: nothing is animated",
                self.file.display()
            );
        }
        if let Some(environment) = &self.environment {
            session.push(Edit::SetEnvironment(environment_argument(environment)?))?;
        }
        if let Some(name) = &self.scene {
            choose_scene(session, name).with_context(|| self.file.display().to_string())?;
            let aspect = f64::from(self.size[0]) / f64::from(self.size[1]);
            session.set_camera(ViewCamera::of_document(session.document(), aspect));
        }
        if let Some(name) = &self.variant {
            choose_variant(session, name).with_context(|| self.file.display().to_string())?;
        }
        if let Some(name) = &self.camera {
            let camera = ViewCamera::named(session.document(), name);
            session.set_camera(camera.with_context(|| self.file.display().to_string())?);
        }
        Ok(())
    }
}

/// Shows the scene of this name, or number from 1, of all instances whose file has it.
fn choose_scene(session: &mut Session, name: &str) -> anyhow::Result<()> {
    let document = session.document();
    let number = name.parse::<usize>().ok().and_then(|number| number.checked_sub(1));
    let (mut edits, mut known) = (Vec::new(), BTreeSet::new());
    for (node, prefab) in
        document.nodes().filter_map(|(id, node)| Some((id, document.prefab(node.prefab()?)?)))
    {
        let names = prefab.scene_names();
        let scene = names.iter().find(|known| *known == name).or_else(|| names.get(number?));
        edits.extend(scene.cloned().map(|scene| Edit::SetScene { node, scene: Some(scene) }));
        known.extend(names);
    }
    if edits.is_empty() {
        let known: Vec<String> = known.into_iter().collect();
        let known = if known.is_empty() { String::from("the file has none") } else { known.join(", ") };
        bail!("no scene '{name}'; there is: {known}");
    }
    Ok(session.push(Edit::batch("chose a scene", edits))?)
}

/// Shows all instances that have a variant of materials of this name in it.
fn choose_variant(session: &mut Session, name: &str) -> anyhow::Result<()> {
    let document = session.document();
    let variants: BTreeMap<_, _> = document.prefabs().map(|(id, prefab)| (id, prefab.variants())).collect();
    let has_it = |prefab| variants.get(&prefab).is_some_and(|known| known.iter().any(|known| known == name));
    let instances = document.nodes().filter(|(_, node)| node.prefab().is_some_and(has_it));
    let choose = |node| Edit::SetVariant { node, variant: Some(name.to_owned()) };
    let edits: Vec<Edit> = instances.map(|(id, _)| choose(id)).collect();
    if edits.is_empty() {
        let known: BTreeSet<String> = variants.into_values().flatten().collect();
        let known: Vec<String> = known.into_iter().collect();
        let known = if known.is_empty() { String::from("the scene has none") } else { known.join(", ") };
        bail!("no variant '{name}'; there is: {known}");
    }
    Ok(session.push(Edit::batch("chose a variant", edits))?)
}

pub(super) fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let expected = "expected WIDTHxHEIGHT in whole pixels, such as 1280x720";
    let (width, height) = text.split_once(['x', 'X']).ok_or(expected)?;
    let side = |text: &str| match text.trim() {
        "" => Err(expected.to_owned()),
        text => text.parse::<u32>().map_err(|_| format!("'{text}' is no number of pixels; {expected}")),
    };
    match [side(width)?, side(height)?] {
        [0, _] | [_, 0] => Err(String::from("a side of 0 pixels")),
        size => Ok(size),
    }
}

pub(super) fn parse_positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(x) if x.is_finite() && x > 0.0 => Ok(x),
        _ => Err(String::from("expected a number above 0")),
    }
}

fn parse_seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(x) if x.is_finite() && x >= 0.0 => Ok(x),
        _ => Err(String::from("expected a number of seconds, 0 or more")),
    }
}
