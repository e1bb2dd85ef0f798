//! What was measured of a device, kept in a file, and what follows from it. Enters: a device. Leaves: figures and
//! yes or no. Whoever asks twice gets the same answer: only `caustica devices --measure` looks at a clock.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use caustica_gpu::{Device, DeviceKind, Frames};
use serde::{Deserialize, Serialize};

use super::accel_bench::AccelBench;
use super::primary_bench;
use crate::error::{RendererError, Result};

/// Triangles of the BLAS that is measured.
const TRIANGLES: u32 = 100_000;
/// Instances of the TLAS that is measured.
const INSTANCES: u32 = 100_000;
/// A refit pays when it takes less than this share of a build: what it leaves is worse to trace.
const REFIT_SHARE: f64 = 0.7;
/// A TLAS is refitted up to this multiple of the time of a build: a refit keeps the places of its instances.
const TLAS_REFIT_SHARE: f64 = 1.2;
/// A compaction pays when it leaves less than this share of the bytes.
const COMPACTED_SHARE: f64 = 0.95;
/// First surfaces by raster and by rays that are usual: of the gallery at 1280 x 720 on lavapipe and on an H100
/// (`tests/bench/results/2026-11-25-lavapipe-gallery.md`, `2026-11-24-h100-gallery.md`).
const PRIMARY_CPU_MS: [f64; 2] = [74.0, 247.0];
const PRIMARY_MS: [f64; 2] = [0.977, 0.366];
/// Version of the file.
const FORMAT: u32 = 1;
/// Longest part of a file name, characters.
const SLUG: usize = 100;

/// What was measured of a device, and what the policy makes of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DeviceProfile {
    format: u32,
    /// Name of the device.
    pub device: String,
    /// Name and version of its driver.
    pub driver: String,
    /// Build of a BLAS of 100,000 triangles that is traced often.
    pub blas_build_ms: f64,
    /// Build of a BLAS of 100,000 triangles that is refitted often.
    pub blas_fast_build_ms: f64,
    /// Its refit.
    pub blas_refit_ms: f64,
    /// Build of a TLAS of 100,000 instances.
    pub tlas_build_ms: f64,
    /// Its refit.
    pub tlas_refit_ms: f64,
    /// Bytes of a BLAS after compaction, by those before.
    pub compacted_share: f64,
    /// The first surfaces of the measured scene; not in files of older versions, which then have those usual for the device.
    #[serde(default)]
    pub primary: Option<PrimaryTimes>,
}

/// The first surfaces of 131,072 triangles in 64 instances at 640 x 360, with normals and materials.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PrimaryTimes {
    /// By the rasteriser.
    pub raster_ms: f64,
    /// By rays.
    pub rays_ms: f64,
}

/// The profile that holds for a device, and the file it is from; without one it is the default of its kind.
#[derive(Clone, Debug, PartialEq)]
pub struct ProfileInForce {
    /// The figures.
    pub profile: DeviceProfile,
    /// Where they are stored; `None`: never measured, or the file is damaged.
    pub file: Option<PathBuf>,
}

impl DeviceProfile {
    /// Measures a device; takes a few seconds. `progress` is told what is measured next.
    ///
    /// # Errors
    /// When memory runs out or the device fails.
    pub fn measure(
        device: &Arc<Device>,
        frames: &mut Frames,
        progress: &mut dyn FnMut(&str),
    ) -> Result<Self> {
        let mut bench = AccelBench::new(device, frames)?;
        progress("100,000 triangles");
        let blas = bench.triangles(TRIANGLES)?;
        progress("100,000 instances");
        let tlas = bench.instances(INSTANCES)?;
        drop(bench);
        progress("first surfaces by raster and by rays");
        let primary = primary_bench::measure(device, frames)?;
        let profile = Self {
            format: FORMAT,
            device: device.name().to_owned(),
            driver: device.driver().to_owned(),
            blas_build_ms: blas.build_fast_trace_ms,
            blas_fast_build_ms: blas.build_fast_build_ms,
            blas_refit_ms: blas.refit_ms,
            tlas_build_ms: tlas.build_ms,
            tlas_refit_ms: tlas.refit_ms,
            compacted_share: blas.compacted_bytes as f64 / blas.bytes.max(1) as f64,
            primary: Some(primary),
        };
        if profile.is_plausible() {
            Ok(profile)
        } else {
            let reason = format!("the device gave times that cannot be: {profile:?}");
            Err(RendererError::Profile { what: profile.device, reason })
        }
    }

    /// What is taken for a device that was never measured, by its kind alone: figures of Mesa's lavapipe for a processor,
    /// of an NVIDIA H100 for everything else.
    pub fn default_for(device: &Device) -> Self {
        Self::default_of(device.name(), device.driver(), device.kind())
    }

    pub(crate) fn default_of(name: &str, driver: &str, kind: DeviceKind) -> Self {
        let [blas_build_ms, blas_fast_build_ms, blas_refit_ms, tlas_build_ms, tlas_refit_ms, compacted_share] =
            match kind {
                DeviceKind::Cpu => [4.7, 4.7, 4.7, 9.0, 9.0, 1.0],
                _ => [0.49, 0.30, 0.09, 0.41, 0.05, 0.86],
            };
        let [raster_ms, rays_ms] = if kind == DeviceKind::Cpu { PRIMARY_CPU_MS } else { PRIMARY_MS };
        Self {
            format: FORMAT,
            device: name.to_owned(),
            driver: driver.to_owned(),
            primary: Some(PrimaryTimes { raster_ms, rays_ms }),
            blas_build_ms,
            blas_fast_build_ms,
            blas_refit_ms,
            tlas_build_ms,
            tlas_refit_ms,
            compacted_share,
        }
    }

    /// The profile in force for a device: the stored one, else the default. A damaged file is a warning in the log.
    pub fn load_for(device: &Device) -> Self {
        Self::in_force(device.name(), device.driver(), device.kind()).profile
    }

    /// The profile in force for a device that need not be open. A damaged file is a warning in the log.
    pub fn in_force(name: &str, driver: &str, kind: DeviceKind) -> ProfileInForce {
        let folder = folder_in(std::env::var_os("XDG_CONFIG_HOME"), std::env::var_os("HOME"));
        Self::in_force_from(folder.as_deref(), name, driver, kind)
    }

    fn in_force_from(folder: Option<&Path>, name: &str, driver: &str, kind: DeviceKind) -> ProfileInForce {
        let file = folder.map(|folder| folder.join(file_name(name, driver))).filter(|file| file.exists());
        let default = || Self::default_of(name, driver, kind);
        let Some(file) = file else { return ProfileInForce { profile: default(), file: None } };
        match read(&file, name, driver) {
            Ok(profile) => {
                let primary = profile.primary.or_else(|| default().primary);
                ProfileInForce { profile: Self { primary, ..profile }, file: Some(file) }
            }
            Err(reason) => {
                tracing::warn!(
                    "{}: {reason}; what is usual for such a device is taken instead \
                     (`caustica devices --measure` writes the file anew)",
                    file.display()
                );
                ProfileInForce { profile: default(), file: None }
            }
        }
    }

    /// Writes it to `$XDG_CONFIG_HOME/caustica/devices`, or to `~/.config/caustica/devices`, as a whole or not at all.
    ///
    /// # Errors
    /// [`RendererError::Profile`] without a home, or with what the file system said.
    pub fn store(&self) -> Result<PathBuf> {
        match folder_in(std::env::var_os("XDG_CONFIG_HOME"), std::env::var_os("HOME")) {
            Some(folder) => self.store_in(&folder),
            None => Err(RendererError::Profile {
                what: String::from("device profile"),
                reason: String::from("there is no folder for it: neither XDG_CONFIG_HOME nor HOME is set"),
            }),
        }
    }

    fn store_in(&self, folder: &Path) -> Result<PathBuf> {
        let file = folder.join(file_name(&self.device, &self.driver));
        // Written under another name first: whoever reads meanwhile sees the old file or the new one.
        let temporary = file.with_extension(format!("{}.tmp", std::process::id()));
        let written = serde_json::to_string_pretty(self).map_err(std::io::Error::other).and_then(|text| {
            std::fs::create_dir_all(folder)?;
            std::fs::write(&temporary, text + "\n")?;
            std::fs::rename(&temporary, &file)
        });
        match written {
            Ok(()) => Ok(file),
            Err(error) => {
                // Best effort: the write is what is reported.
                let _ = std::fs::remove_file(&temporary);
                Err(RendererError::Profile { what: file.display().to_string(), reason: error.to_string() })
            }
        }
    }

    /// Whether a BLAS that deforms is refitted rather than built anew.
    pub fn refit_pays(&self) -> bool {
        self.blas_refit_ms < REFIT_SHARE * self.blas_fast_build_ms
    }

    /// Whether a TLAS whose instances moved is refitted rather than built anew: unless that costs clearly more.
    pub fn refits_tlas(&self) -> bool {
        self.tlas_refit_ms <= TLAS_REFIT_SHARE * self.tlas_build_ms
    }

    /// Whether a BLAS is copied into its compacted size.
    pub fn compaction_pays(&self) -> bool {
        self.compacted_share < COMPACTED_SHARE
    }

    /// Whether rays find the first surfaces faster than the rasteriser.
    pub fn primary_rays_pay(&self) -> bool {
        self.primary.is_some_and(|primary| primary.rays_ms < primary.raster_ms)
    }

    /// How many triangles are first built in `ms` milliseconds.
    pub fn triangles_in(&self, ms: f64) -> u64 {
        // The conversion saturates; times are above 0.
        (ms / self.blas_build_ms * f64::from(TRIANGLES)) as u64
    }

    fn is_plausible(&self) -> bool {
        [
            self.blas_build_ms,
            self.blas_fast_build_ms,
            self.blas_refit_ms,
            self.tlas_build_ms,
            self.tlas_refit_ms,
            self.compacted_share,
        ]
        .into_iter()
        .chain(self.primary.iter().flat_map(|primary| [primary.raster_ms, primary.rays_ms]))
        .all(|figure| figure.is_finite() && figure > 0.0)
    }
}

/// Reads a profile; says in words why it does not hold for this device.
fn read(file: &Path, name: &str, driver: &str) -> std::result::Result<DeviceProfile, String> {
    let text = std::fs::read_to_string(file).map_err(|error| error.to_string())?;
    let profile: DeviceProfile =
        serde_json::from_str(&text).map_err(|error| format!("not a device profile: {error}"))?;
    if profile.format != FORMAT {
        return Err(format!("format {} is not the {FORMAT} of this version", profile.format));
    }
    if profile.device != name || profile.driver != driver {
        return Err(format!("it is of another device: {}, {}", profile.device, profile.driver));
    }
    if !profile.is_plausible() {
        return Err(String::from("a figure in it is not above 0"));
    }
    Ok(profile)
}

/// Where profiles are, by the XDG base directory specification: a relative path there counts as none.
fn folder_in(config_home: Option<OsString>, home: Option<OsString>) -> Option<PathBuf> {
    let config = config_home.map(PathBuf::from).filter(|path| path.is_absolute());
    let home = home.filter(|home| !home.is_empty()).map(|home| PathBuf::from(home).join(".config"));
    config.or(home).map(|base| base.join("caustica").join("devices"))
}

fn file_name(device: &str, driver: &str) -> String {
    format!("{}-{}.json", slug(device), slug(driver))
}

/// Small letters, digits and single dashes.
fn slug(text: &str) -> String {
    let words = text.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
    let slug = words.collect::<Vec<_>>().join("-").to_ascii_lowercase();
    slug.chars().take(SLUG).collect()
}

#[cfg(test)]
#[expect(clippy::expect_used, reason = "a test says what is wrong by panicking")]
mod tests {
    use super::*;

    const NAME: &str = "NVIDIA H100 80GB HBM3";
    const DRIVER: &str = "NVIDIA 580.159.04";

    fn measured() -> DeviceProfile {
        DeviceProfile {
            blas_fast_build_ms: 0.4,
            blas_refit_ms: 0.123_456_789_012_345,
            ..DeviceProfile::default_of(NAME, DRIVER, DeviceKind::Discrete)
        }
    }

    /// A folder of its own that vanishes.
    struct Folder(PathBuf);

    impl Folder {
        fn new(name: &str) -> Self {
            let path = std::env::temp_dir().join(format!("caustica-{name}-{}", std::process::id()));
            Self(path)
        }

        fn in_force(&self) -> ProfileInForce {
            DeviceProfile::in_force_from(Some(&self.0), NAME, DRIVER, DeviceKind::Discrete)
        }
    }

    impl Drop for Folder {
        fn drop(&mut self) {
            let _ = std::fs::remove_dir_all(&self.0);
        }
    }

    #[test]
    fn a_processor_refits_and_compacts_nothing_a_card_does_both() {
        let processor = DeviceProfile::default_of("llvmpipe", "Mesa", DeviceKind::Cpu);
        assert!(!processor.refit_pays() && processor.refits_tlas() && !processor.compaction_pays());
        assert!(!processor.primary_rays_pay());
        for kind in [DeviceKind::Discrete, DeviceKind::Integrated, DeviceKind::Virtual, DeviceKind::Other] {
            let card = DeviceProfile::default_of(NAME, DRIVER, kind);
            assert!(
                card.refit_pays() && card.refits_tlas() && card.compaction_pays() && card.primary_rays_pay()
            );
        }
    }

    #[test]
    fn decisions_turn_at_their_shares() {
        let at = |refit: f64, share: f64| DeviceProfile {
            blas_fast_build_ms: 1.0,
            blas_refit_ms: refit,
            tlas_build_ms: 1.0,
            tlas_refit_ms: refit,
            compacted_share: share,
            ..measured()
        };
        let (just, not) = (at(0.69, 0.94), at(0.7, 0.95));
        assert!(just.refit_pays() && just.compaction_pays());
        assert!(!not.refit_pays() && !not.compaction_pays());
        assert!(at(1.2, 0.9).refits_tlas() && !at(1.3, 0.9).refits_tlas());
    }

    #[test]
    fn time_becomes_triangles() {
        let profile = DeviceProfile { blas_build_ms: 0.5, ..measured() };
        assert_eq!(profile.triangles_in(4.0), 800_000);
        assert_eq!(profile.triangles_in(0.0), 0);
        assert_eq!(profile.triangles_in(-1.0), 0);
    }

    #[test]
    fn what_is_stored_comes_back_to_the_last_bit() {
        let folder = Folder::new("profile-stored");
        assert_eq!(folder.in_force().file, None, "nothing is stored yet");
        let file = measured().store_in(&folder.0).expect("the temporary folder can be written");
        assert_eq!(
            file.file_name().and_then(|n| n.to_str()),
            Some("nvidia-h100-80gb-hbm3-nvidia-580-159-04.json")
        );
        assert_eq!(folder.in_force(), ProfileInForce { profile: measured(), file: Some(file) });
        let names = std::fs::read_dir(&folder.0).expect("the folder").count();
        assert_eq!(names, 1, "no temporary file is left");
    }

    #[test]
    fn a_file_of_an_older_version_has_the_usual_first_surfaces() {
        let folder = Folder::new("profile-older");
        let older = DeviceProfile { primary: None, ..measured() };
        let file = older.store_in(&folder.0).expect("the temporary folder can be written");
        assert_eq!(folder.in_force(), ProfileInForce { profile: measured(), file: Some(file) });
    }

    #[test]
    fn a_file_that_does_not_hold_is_replaced_by_the_default() {
        let folder = Folder::new("profile-damaged");
        let file = measured().store_in(&folder.0).expect("the temporary folder can be written");
        let good = std::fs::read_to_string(&file).expect("the file");
        let default = DeviceProfile::default_of(NAME, DRIVER, DeviceKind::Discrete);
        let spoilt = [
            (String::new(), "not a device profile"),
            (good[..good.len() / 2].to_owned(), "not a device profile"),
            (good.replace("\"format\": 1", "\"format\": 2"), "format 2"),
            (good.replace("580.159", "570.1"), "another device: NVIDIA H100 80GB HBM3, NVIDIA 570.1"),
            (good.replace("0.4,", "0.0,"), "not above 0"),
            (good.replace("0.4,", "-3,"), "not above 0"),
            (good.replace("0.4,", "null,"), "not a device profile"),
        ];
        for (text, reason) in spoilt {
            assert_ne!(text, good);
            std::fs::write(&file, &text).expect("the file can be written");
            let said = read(&file, NAME, DRIVER).expect_err("it is spoilt");
            assert!(said.contains(reason), "{said}");
            assert_eq!(folder.in_force(), ProfileInForce { profile: default.clone(), file: None });
        }
    }

    #[test]
    fn the_folder_follows_the_xdg_specification() {
        let folder = |config: Option<&str>, home: Option<&str>| {
            folder_in(config.map(OsString::from), home.map(OsString::from))
        };
        let at = |path: &str| Some(PathBuf::from(path));
        assert_eq!(folder(Some("/c"), Some("/h")), at("/c/caustica/devices"));
        assert_eq!(folder(None, Some("/h")), at("/h/.config/caustica/devices"));
        assert_eq!(folder(Some("relative"), Some("/h")), at("/h/.config/caustica/devices"));
        assert_eq!(folder(Some(""), Some("")), None);
    }

    #[test]
    fn names_become_file_names() {
        assert_eq!(slug("llvmpipe (LLVM 19.1.7, 256 bits)"), "llvmpipe-llvm-19-1-7-256-bits");
        assert_eq!(slug("../../etc/passwd"), "etc-passwd");
        assert_eq!(slug(&"x".repeat(500)).len(), SLUG);
    }
}
