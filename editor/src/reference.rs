//! The picture that errors are measured against: an EXR file, or one of the path tracer, kept beside the scene's file until
//! something changes that is seen in it. Enters: a session, a number of samples. Leaves: two halves of a picture.

use std::fmt::Write as _;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use caustica_renderer::shader::ShaderSources;
use caustica_renderer::{Accumulated, Pipeline, Sampler, ViewSettings};
use caustica_scene::{Project, ProjectMeta};

use crate::exr_file::{self, Note};
use crate::session::Session;

/// Of a reference's random numbers: a picture that is compared with it has others, else both err alike.
pub const SEED: u32 = 0x5eed;
/// Channels of the mean, and of half of the difference of the two streams.
const CHANNELS: [[&str; 3]; 2] =
    [["R", "G", "B"], ["halfDifference.R", "halfDifference.G", "halfDifference.B"]];
/// Attribute with the number of samples, and with what the picture depends on.
const SAMPLES: &str = "caustica.samples";
const KEY: &str = "caustica.reference";

/// Settings of the path tracer for the truth about a scene that is looked at with `settings`.
pub fn settings_of_truth(settings: &ViewSettings) -> ViewSettings {
    ViewSettings {
        pipeline: Pipeline::Path,
        sampler: Sampler::Sobol,
        seed: SEED,
        // The truth knows no limit, and reflects light as often as surfaces do as glTF describes them.
        path_depth: None,
        multiple_scattering: settings.multiple_scattering,
        ..ViewSettings::default()
    }
    .for_still(false, false)
}

/// Where the reference of a scene is kept, and what it depends on.
#[derive(Clone, Debug)]
pub struct Kept {
    /// The file.
    pub path: PathBuf,
    key: String,
}

impl Kept {
    /// Of what a session shows, `extent_px` large, with so many samples, for the scene of a file.
    ///
    /// # Errors
    /// When the scene cannot be written as a project, or a shader cannot be read.
    pub fn of(session: &Session, file: &Path, extent_px: [u32; 2], samples: u64) -> anyhow::Result<Self> {
        let document = session.document();
        let text = Project::text_of(file, document, &ProjectMeta::default())?;
        let settings = settings_of_truth(session.settings());
        let view = serde_json::to_string(&(session.camera(), &settings, extent_px, samples, session.time()))?;
        let mut hasher = DefaultHasher::new();
        (env!("CARGO_PKG_VERSION"), &text, view).hash(&mut hasher);
        for source in document.sources() {
            // One that is missing is so in the picture too.
            std::fs::read(&source).ok().hash(&mut hasher);
        }
        let shaders = ShaderSources::new(session.shader_folder());
        for name in ShaderSources::built_in_files() {
            shaders.read(&name).ok().hash(&mut hasher);
        }
        let key = format!("{:016x}", hasher.finish());
        let mut name = file.file_name().unwrap_or_default().to_owned();
        let mut suffix = String::from(".reference");
        // Of one scene there may be several: of other cameras, times, sizes.
        write!(suffix, "-{}x{}-{samples}-{}.exr", extent_px[0], extent_px[1], &key[..8])?;
        name.push(suffix);
        Ok(Self { path: file.with_file_name(name), key })
    }

    /// The picture, where it is there and still that of the scene.
    ///
    /// # Errors
    /// When a file of that name is there and cannot be read.
    pub fn load(&self, extent_px: [u32; 2]) -> anyhow::Result<Option<Accumulated>> {
        if !self.path.is_file() {
            return Ok(None);
        }
        let (picture, key) = load(&self.path, extent_px)?;
        Ok((key.as_deref() == Some(self.key.as_str())).then_some(picture))
    }

    /// Keeps the picture for the next time.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn save(&self, picture: &Accumulated) -> anyhow::Result<()> {
        save(&self.path, picture, &self.key)
    }
}

/// Reads the reference of an EXR file. One that other programs wrote has no halves, and its noise is taken for the truth.
///
/// # Errors
/// When the file cannot be read, has other channels than R, G and B, or another size.
pub fn read_exr(path: &Path, extent_px: [u32; 2]) -> anyhow::Result<Accumulated> {
    Ok(load(path, extent_px)?.0)
}

fn load(path: &Path, extent_px: [u32; 2]) -> anyhow::Result<(Accumulated, Option<String>)> {
    let (channels, notes) = exr_file::read(path, extent_px).context("the reference")?;
    let [mean, half_difference] = CHANNELS.map(|names| exr_file::pixels_of(names, &channels));
    let Some(mean) = mean else { bail!("{}: the image has no channels R, G and B", path.display()) };
    if let Some(at) = mean.iter().position(|pixel| !pixel.iter().all(|value| value.is_finite())) {
        let width = extent_px[0] as usize;
        bail!("{}: pixel {}, {} is not finite: that is no reference", path.display(), at % width, at / width);
    }
    let samples = notes.get(SAMPLES).and_then(|text| text.parse().ok()).unwrap_or(0);
    let half_difference = half_difference.unwrap_or_else(|| vec![[0.0; 3]; mean.len()]);
    Ok((Accumulated { extent: extent_px, samples, mean, half_difference }, notes.get(KEY).cloned()))
}

fn save(path: &Path, picture: &Accumulated, key: &str) -> anyhow::Result<()> {
    let pixels = CHANNELS.into_iter().zip([&picture.mean, &picture.half_difference]);
    let channels = pixels.flat_map(|(names, pixels)| exr_file::channels_of(names, pixels)).collect();
    let notes = [(SAMPLES, picture.samples.to_string()), (KEY, key.to_owned())];
    exr_file::write(path, picture.extent, channels, notes.map(|(name, text)| (name, Note::Text(text))))
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a test may panic")]

    use super::*;

    #[test]
    fn both_halves_come_back_and_what_is_no_reference_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let mut picture = Accumulated {
            extent: [3, 2],
            samples: 64,
            mean: (0_u8..6).map(|i| [f32::from(i), 0.5, 1e-9]).collect(),
            half_difference: (0_u8..6).map(|i| [0.0, -f32::from(i), 2.0]).collect(),
        };
        save(&path, &picture, "0123").unwrap();
        let (found, key) = load(&path, [3, 2]).unwrap();
        assert_eq!((found, key.as_deref()), (picture.clone(), Some("0123")));
        let error = read_exr(&path, [2, 3]).unwrap_err();
        let error = format!("{error:#}");
        assert!(error.contains("3 x 2, not 2 x 3"), "{error}");
        picture.mean[4][1] = f32::NAN;
        save(&path, &picture, "").unwrap();
        let error = read_exr(&path, [3, 2]).unwrap_err();
        let error = format!("{error:#}");
        assert!(error.contains("pixel 1, 1 is not finite"), "{error}");
        assert!(read_exr(&folder.path().join("none.exr"), [3, 2]).is_err());
    }
}
