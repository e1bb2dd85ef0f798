//! What this scene needs. Enters: counts of what the scene holds, and the view's settings. Leaves: which passes run,
//! which branches stay in the shaders, and a sentence for everything that was left out. Pure: no device.

use std::collections::BTreeMap;

use caustica_gpu::Specialization;

use crate::delta::{Material, MaterialId, ShadingMode};
use crate::measure::LeftOut;
use crate::settings::{NeedsMode, Pipeline, Primary, ReflectionRate, ShadowRate, Show, ViewSettings};
use crate::tables::{emits, has_alpha, is_opaque, transmits};

/// What a scene holds, as far as it decides what is needed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SceneSummary {
    /// Punctual lights that shine.
    pub lights: u32,
    /// Every punctual light is a point or infinitely small.
    pub all_lights_hard: bool,
    /// Triangles that emit.
    pub emissive_triangles: u32,
    /// The environment is not black.
    pub environment: bool,
    /// The environment is a map.
    pub environment_map: bool,
    /// What the materials in use bring.
    pub surfaces: SurfaceSummary,
    /// Some mesh holds spheres or boxes.
    pub shapes: bool,
}

impl Default for SceneSummary {
    /// That of an empty scene.
    fn default() -> Self {
        Self {
            lights: 0,
            all_lights_hard: true,
            emissive_triangles: 0,
            environment: false,
            environment_map: false,
            surfaces: SurfaceSummary::default(),
            shapes: false,
        }
    }
}

/// What one or several materials bring, as far as it decides what is needed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct SurfaceSummary {
    /// Some material has a texture.
    pub textures: bool,
    /// Some material has a normal map.
    pub normal_maps: bool,
    /// Some material emits or is unlit.
    pub emission: bool,
    /// Some material mirrors.
    pub mirrors: bool,
    /// The smallest roughness of a PBR material, in thousandths; textured roughness and glossiness count as 0.
    pub min_roughness_permille: u32,
    /// Some surface lets light pass.
    pub transmission: bool,
    /// Some surface has holes or coverage.
    pub alpha: bool,
    /// Some geometry is not opaque to rays.
    pub any_hit: bool,
    /// Some material has lobes beside metallic-roughness, or textures of specular or transmission.
    pub lobes: bool,
}

impl Default for SurfaceSummary {
    /// That of no material.
    fn default() -> Self {
        Self {
            textures: false,
            normal_maps: false,
            emission: false,
            mirrors: false,
            min_roughness_permille: 1001,
            transmission: false,
            alpha: false,
            any_hit: false,
            lobes: false,
        }
    }
}

impl SurfaceSummary {
    fn of(material: &Material) -> Self {
        let glossy = material.lobes.as_ref().is_some_and(|lobes| lobes.glossiness.is_some());
        let textured = material.metallic_roughness_texture.is_some() || glossy;
        let roughness = if textured { 0.0 } else { material.roughness.clamp(0.0, 1.0) };
        let is_pbr = material.mode == ShadingMode::Pbr;
        Self {
            textures: material.textures().next().is_some(),
            normal_maps: material.normal_texture.is_some(),
            emission: emits(material) || material.mode == ShadingMode::Unlit,
            mirrors: material.mode == ShadingMode::Reflective,
            min_roughness_permille: if is_pbr { (roughness * 1000.0) as u32 } else { 1001 },
            transmission: transmits(material) || scatters_into_volume(material),
            alpha: has_alpha(material),
            any_hit: !is_opaque(material),
            lobes: material.lobes.as_ref().is_some_and(|lobes| !lobes.is_plain()),
        }
    }

    fn join(self, other: Self) -> Self {
        Self {
            textures: self.textures || other.textures,
            normal_maps: self.normal_maps || other.normal_maps,
            emission: self.emission || other.emission,
            mirrors: self.mirrors || other.mirrors,
            min_roughness_permille: self.min_roughness_permille.min(other.min_roughness_permille),
            transmission: self.transmission || other.transmission,
            alpha: self.alpha || other.alpha,
            any_hit: self.any_hit || other.any_hit,
            lobes: self.lobes || other.lobes,
        }
    }
}

/// The materials in use by what they bring, so that a change of one costs the kinds there are, not the materials.
#[derive(Debug, Default)]
pub(crate) struct SurfaceTally {
    known: BTreeMap<MaterialId, SurfaceSummary>,
    counts: BTreeMap<SurfaceSummary, u32>,
}

impl SurfaceTally {
    /// A material in use is this now; `None`: nothing has it any more.
    pub(crate) fn set(&mut self, id: MaterialId, material: Option<&Material>) {
        let now = material.map(SurfaceSummary::of);
        let before = match now {
            Some(now) => self.known.insert(id, now),
            None => self.known.remove(&id),
        };
        if let Some(count) = before.and_then(|before| self.counts.get_mut(&before)) {
            *count -= 1;
        }
        if let Some(now) = now {
            *self.counts.entry(now).or_insert(0) += 1;
        }
        self.counts.retain(|_, count| *count > 0);
    }

    /// What they bring together.
    pub(crate) fn summary(&self) -> SurfaceSummary {
        self.counts.keys().fold(SurfaceSummary::default(), |all, kind| all.join(*kind))
    }
}

/// Whether light enters a volume scattered (KHR_materials_diffuse_transmission).
fn scatters_into_volume(material: &Material) -> bool {
    let scatters = material.lobes.as_ref().is_some_and(|lobes| lobes.diffuse_transmission > 0.0);
    scatters && material.has_volume && material.mode == ShadingMode::Pbr
}

/// What is built and run for one view.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Needs {
    /// Punctual lights.
    pub lights: bool,
    /// Emissive triangles as lights.
    pub emissive_lights: bool,
    /// Light of the environment.
    pub environment: bool,
    /// The environment is a map.
    pub environment_map: bool,
    /// Textures.
    pub textures: bool,
    /// Normal maps.
    pub normal_maps: bool,
    /// Mirrored directions, by rays or (raster) of the environment alone.
    pub reflection: bool,
    /// Refracted directions, by rays or (raster) of the environment alone.
    pub refraction: bool,
    /// The emissive target.
    pub emission: bool,
    /// Any-hit shaders.
    pub any_hit: bool,
    /// The alpha variant of the raster G-buffer.
    pub alpha: bool,
    /// Shadow rays: false in the raster pipeline.
    pub shadow_rays: bool,
    /// Light is denoised over time while something moves.
    pub temporal: bool,
    /// And over space.
    pub spatial: bool,
    /// Motion vectors.
    pub motion: bool,
    /// Spheres and boxes.
    pub shapes: bool,
    /// Rays find the primary surfaces, not the rasteriser.
    pub primary_rays: bool,
    /// Lobes of materials beside metallic-roughness, and textures of specular and transmission.
    pub lobes: bool,
    /// Paths carry the light, not the passes for shadow and shading.
    pub paths: bool,
    /// Shadow rays are left out where the frames before tell what they meet. A choice of the view, as the next one.
    pub known_shadows: bool,
    /// The number of rays behind a surface is shown. What is shown is no need of the scene: false with `NeedsMode::All`
    /// too, unless it is.
    pub ray_depth: bool,
}

impl Needs {
    /// Decides for a scene and the settings of a view, whose [`Primary::Auto`] counts as raster.
    pub fn of(scene: &SceneSummary, settings: &ViewSettings) -> Self {
        let surfaces = &scene.surfaces;
        let rays = settings.pipeline != Pipeline::Raster;
        let all = settings.needs == NeedsMode::All;
        let roughness_max = (settings.reflection_roughness_max * 1000.0) as u32;
        let paths = settings.pipeline == Pipeline::Path;
        let secondary = paths || settings.max_depth > 0;
        let noisy = !scene.all_lights_hard
            || scene.lights > settings.light_samples
            || scene.emissive_triangles > 0
            || scene.environment
            || surfaces.alpha
            || (paths && scene.lights > 0);
        let temporal = settings.temporal && rays;
        Self {
            lights: all || scene.lights > 0,
            emissive_lights: all || scene.emissive_triangles > 0,
            environment: all || scene.environment,
            environment_map: all || scene.environment_map,
            textures: all || surfaces.textures,
            normal_maps: all || surfaces.normal_maps,
            reflection: secondary
                && (all || surfaces.mirrors || surfaces.min_roughness_permille <= roughness_max),
            refraction: secondary && (all || surfaces.transmission),
            emission: all || surfaces.emission,
            any_hit: rays && (all || surfaces.any_hit),
            alpha: all || surfaces.alpha,
            shadow_rays: rays,
            temporal: temporal && (all || noisy),
            spatial: temporal && settings.spatial && (all || noisy),
            motion: all || settings.show == Show::Motion || (temporal && noisy),
            shapes: all || scene.shapes,
            primary_rays: paths
                || settings.pipeline == Pipeline::Raytraced
                || (rays && (scene.shapes || settings.primary == Primary::Rays)),
            paths,
            known_shadows: settings.shadow_rate == ShadowRate::Penumbra
                && temporal
                && !paths
                && (all || (noisy && scene.lights > 0)),
            // Not with `all` alone: reading the textures of lobes takes lavapipe a minute to compile, in every general variant.
            lobes: surfaces.lobes,
            ray_depth: settings.show == Show::RayDepth,
        }
    }

    /// Whether any light arrives at surfaces, so that the shadow pass runs.
    pub fn direct_light(&self) -> bool {
        self.lights || self.emissive_lights || self.environment
    }

    /// Whether the shading pass traces rays of its own.
    pub fn secondary_rays(&self) -> bool {
        self.shadow_rays && (self.reflection || self.refraction)
    }

    /// Whether reflected light is denoised, and so can be traced by some pixels for others.
    fn halves_reflections(&self) -> bool {
        self.temporal && self.secondary_rays() && !self.paths
    }

    /// Constants of `shaders/shared/needs.glsl`, in its order.
    pub fn specialization(&self) -> Specialization {
        let values = [
            self.lights,
            self.emissive_lights,
            self.environment,
            self.environment_map,
            self.textures,
            self.normal_maps,
            self.reflection,
            self.refraction,
            self.emission,
            self.shadow_rays,
            self.motion,
            self.shapes,
            self.lobes,
            self.ray_depth,
            self.temporal,
            self.known_shadows,
        ];
        Specialization {
            values: values.iter().enumerate().map(|(id, v)| (id as u32, u32::from(*v))).collect(),
        }
    }

    /// What was left out, and why, in words.
    pub fn left_out(&self, settings: &ViewSettings) -> Vec<LeftOut> {
        let rays = settings.pipeline != Pipeline::Raster;
        let no_rays = "the raster pipeline casts no rays";
        let why_no_secondary = |nothing: &'static str| {
            if !rays {
                no_rays
            } else if settings.max_depth == 0 {
                "the depth of reflections is set to 0"
            } else {
                nothing
            }
        };
        let why_not_denoised = |switched_off: &'static str| {
            if !rays {
                no_rays
            } else if settings.temporal && !self.temporal {
                "every light is hard, so one ray gives the exact shadow"
            } else {
                switched_off
            }
        };
        let list: [(bool, &str, &str); 19] = [
            (
                rays && self.direct_light(),
                "shadow rays",
                if rays { "the scene has no light, no emitter and a black environment" } else { no_rays },
            ),
            (self.lights, "punctual lights", "the scene has none"),
            (self.emissive_lights, "emissive triangles as lights", "no surface emits"),
            (self.environment, "environment light", "the environment is black"),
            (self.environment_map || !self.environment, "environment map", "the environment is a constant"),
            (self.textures, "texture look-ups", "no material has a texture"),
            (self.normal_maps, "normal mapping", "no material has a normal map"),
            (self.lobes, "coats, sheen, films and other lobes", "every material is plain metallic-roughness"),
            (
                rays && (self.reflection || self.paths),
                "reflection rays",
                why_no_secondary("no surface is smooth enough to mirror"),
            ),
            (rays && self.refraction, "refraction rays", why_no_secondary("no surface lets light pass")),
            (
                settings.reflection_rate == ReflectionRate::Full || self.halves_reflections(),
                "reflections at half the rate",
                if self.paths { "a path carries all light" } else { "no reflected light is denoised" },
            ),
            (
                settings.shadow_rate == ShadowRate::Full || self.known_shadows,
                "shadow rays in penumbrae alone",
                match () {
                    () if self.paths => "a path carries all light",
                    () if !self.lights => "the scene has no punctual light",
                    () => why_not_denoised("no light is denoised over time"),
                },
            ),
            (self.emission, "emissive target", "no surface emits"),
            (self.motion, "motion vectors", "nothing is denoised over time"),
            (self.any_hit, "any-hit shaders", if rays { "every surface is opaque" } else { no_rays }),
            (self.shapes, "spheres and boxes", "every mesh is made of triangles"),
            (
                settings.pipeline != Pipeline::Hybrid || !self.primary_rays,
                "raster of primary surfaces",
                match settings.primary {
                    _ if self.shapes => {
                        "the scene holds spheres or boxes, which rays meet without drawing each"
                    }
                    Primary::Auto => "rays find the first surfaces faster, by the profile of the device",
                    _ => "rays find the first surfaces, by the settings",
                },
            ),
            (self.temporal, "temporal denoising", why_not_denoised("a still image accumulates its samples")),
            (
                self.spatial,
                "spatial denoising",
                why_not_denoised(if settings.temporal {
                    "it is switched off"
                } else {
                    "a still image accumulates its samples"
                }),
            ),
        ];
        list.into_iter()
            .filter(|(needed, ..)| !needed)
            .map(|(_, what, why)| LeftOut { what: what.to_owned(), why: why.to_owned() })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn summary(materials: &[Material]) -> SceneSummary {
        let mut tally = SurfaceTally::default();
        (0..).zip(materials).for_each(|(id, material)| tally.set(MaterialId(id), Some(material)));
        SceneSummary { surfaces: tally.summary(), ..SceneSummary::default() }
    }

    fn rough() -> Material {
        Material { metallic: 0.0, roughness: 1.0, ..Material::default() }
    }

    #[test]
    fn a_dark_rough_scene_needs_nothing() {
        let needs = Needs::of(&summary(&[rough()]), &ViewSettings::default());
        assert!(!needs.direct_light() && !needs.secondary_rays() && !needs.any_hit && !needs.temporal);
        let left_out: Vec<_> = needs.left_out(&ViewSettings::default()).into_iter().map(|l| l.what).collect();
        assert!(
            left_out.contains(&String::from("shadow rays"))
                && left_out.contains(&String::from("reflection rays"))
        );
    }

    #[test]
    fn hard_lights_need_shadow_rays_but_no_denoising() {
        let scene = SceneSummary { lights: 2, ..summary(&[rough()]) };
        let needs = Needs::of(&scene, &ViewSettings::default());
        assert!(needs.direct_light() && !needs.temporal);
        let many = SceneSummary { lights: 20, ..scene };
        assert!(Needs::of(&many, &ViewSettings::default()).temporal, "lights drawn at random are noisy");
        let soft = SceneSummary { all_lights_hard: false, ..scene };
        assert!(Needs::of(&soft, &ViewSettings::default()).temporal);
    }

    #[test]
    fn each_kind_of_surface_brings_its_rays() {
        let settings = ViewSettings::default();
        let mirror = Material { mode: ShadingMode::Reflective, ..rough() };
        let glass = Material { mode: ShadingMode::Refractive, ..rough() };
        let smooth = Material { roughness: 0.2, ..rough() };
        assert!(Needs::of(&summary(&[rough(), mirror]), &settings).reflection);
        let needs = Needs::of(&summary(&[glass]), &settings);
        assert!(needs.refraction && needs.any_hit);
        assert!(Needs::of(&summary(std::slice::from_ref(&smooth)), &settings).reflection);
        let no_depth = ViewSettings { max_depth: 0, ..settings.clone() };
        assert!(!Needs::of(&summary(std::slice::from_ref(&smooth)), &no_depth).reflection);
        let raster = ViewSettings { pipeline: Pipeline::Raster, ..settings };
        assert!(!Needs::of(&summary(&[smooth]), &raster).secondary_rays());
    }

    #[test]
    fn materials_that_come_change_and_go_leave_what_the_others_bring() {
        let mirror = Material { mode: ShadingMode::Reflective, ..rough() };
        let glass = Material { mode: ShadingMode::Refractive, ..rough() };
        let smooth = Material { roughness: 0.2, ..rough() };
        let mut tally = SurfaceTally::default();
        let ids = [0, 1, 2, 3].map(MaterialId);
        for (id, material) in ids.iter().zip([&mirror, &glass, &smooth, &smooth]) {
            tally.set(*id, Some(material));
        }
        assert_eq!(tally.summary(), summary(&[mirror.clone(), glass.clone(), smooth.clone()]).surfaces);
        tally.set(ids[0], Some(&rough()));
        tally.set(ids[2], None);
        tally.set(ids[2], None);
        assert_eq!(tally.summary(), summary(&[rough(), glass, smooth]).surfaces);
        ids.iter().for_each(|id| tally.set(*id, None));
        assert_eq!(tally.summary(), SurfaceSummary::default());
    }

    #[test]
    fn rays_find_the_first_surfaces_where_they_are_asked_to() {
        let rays = ViewSettings { primary: Primary::Rays, ..ViewSettings::default() };
        let raster = ViewSettings { primary: Primary::Raster, ..ViewSettings::default() };
        let (plain, shapes) = (summary(&[rough()]), SceneSummary { shapes: true, ..summary(&[rough()]) });
        assert!(Needs::of(&plain, &rays).primary_rays && !Needs::of(&plain, &raster).primary_rays);
        assert!(!Needs::of(&plain, &ViewSettings::default()).primary_rays);
        assert!(Needs::of(&shapes, &raster).primary_rays);
        let no_rays = ViewSettings { pipeline: Pipeline::Raster, ..rays };
        assert!(!Needs::of(&plain, &no_rays).primary_rays);
    }

    #[test]
    fn shadows_are_remembered_of_punctual_lights_in_denoised_light() {
        let settings = ViewSettings { shadow_rate: ShadowRate::Penumbra, ..ViewSettings::default() };
        let soft = SceneSummary { lights: 1, all_lights_hard: false, ..summary(&[rough()]) };
        let known = |scene: &SceneSummary, settings: &ViewSettings| Needs::of(scene, settings).known_shadows;
        assert!(known(&soft, &settings) && !known(&soft, &ViewSettings::default()));
        assert!(!known(&SceneSummary { all_lights_hard: true, ..soft }, &settings));
        assert!(!known(&SceneSummary { lights: 0, environment: true, ..soft }, &settings));
        assert!(!known(&soft, &ViewSettings { pipeline: Pipeline::Path, ..settings.clone() }));
        assert!(!known(&soft, &ViewSettings { temporal: false, ..settings }));
    }

    #[test]
    fn all_means_all() {
        let settings = ViewSettings {
            needs: NeedsMode::All,
            show: Show::RayDepth,
            shadow_rate: ShadowRate::Penumbra,
            ..ViewSettings::default()
        };
        let coat = crate::delta::Lobes { clearcoat: 1.0, ..Default::default() };
        let coated = Material { lobes: Some(Box::new(coat)), ..rough() };
        let needs = Needs::of(&summary(&[coated]), &settings);
        assert!(needs.left_out(&settings).is_empty());
        assert!(needs.specialization().values.iter().all(|(_, value)| *value == 1));
    }
}
