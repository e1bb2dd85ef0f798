//! The images of a view. What its needs leave out is not made.

use std::sync::Arc;

use caustica_gpu::{Device, Format, Image, ImageDesc, ImageUse};

use crate::error::Result;
use crate::needs::Needs;
use crate::settings::Show;

/// Images that the next frame reads as its past: two of each, taken in turns.
pub(crate) struct History {
    pub(crate) diffuse: [Image; 2],
    /// One texel, as the light of paths is whole.
    pub(crate) specular: [Image; 2],
    /// One texel when no rays leave the first surfaces.
    pub(crate) reflected: [Image; 2],
    /// Of the reflected light, with the depth of its image; one texel as there.
    pub(crate) image: [Image; 2],
    /// Of direct light; one texel when nothing is filtered over space.
    pub(crate) moments: [Image; 2],
    /// Diffuse, specular and reflected light in turns between the steps of the filter; one texel as in the four above.
    pub(crate) filtered: [[Image; 3]; 2],
    /// What the steps of the filter compare these by, in turns as well; one texel when nothing is filtered over space.
    pub(crate) guide: [Image; 2],
}

/// The images of another size that hold the past of a view which was resized.
pub(crate) struct Past {
    pub(crate) normal: Vec<Image>,
    pub(crate) depth: Vec<Image>,
    pub(crate) history: History,
}

/// The images of a view.
pub(crate) struct Targets {
    pub(crate) id: Image,
    /// Two when the temporal pass compares with the last frame, else one.
    pub(crate) normal: Vec<Image>,
    /// As `normal`.
    pub(crate) depth: Vec<Image>,
    pub(crate) base_color: Image,
    pub(crate) material: Image,
    /// One texel that is bound and never written when nothing reads motion vectors.
    pub(crate) motion: Image,
    pub(crate) emissive: Option<Image>,
    pub(crate) direct_diffuse: Option<Image>,
    pub(crate) direct_specular: Option<Image>,
    /// What rays bring, to be denoised; one texel when nothing is.
    pub(crate) reflected: Image,
    pub(crate) reflected_tint: Image,
    /// What shadow rays met, and for the next frame: two taken in turns as those of the history; one texel when none is left
    /// out.
    pub(crate) shadows: [Image; 2],
    pub(crate) history: Option<History>,
    /// There until a frame of the new size is complete, in place of what `normal`, `depth` and `history` hold of the past.
    pub(crate) past: Option<Past>,
    pub(crate) shaded: Image,
    /// One texel that is bound and never written unless the number of rays is shown and rays are traced.
    pub(crate) ray_depth: Image,
    /// There while the shadow of a light is shown.
    pub(crate) light_shadow: Option<Image>,
    pub(crate) display: Image,
    pub(crate) window: Option<Image>,
}

impl Targets {
    pub(crate) fn new(device: &Arc<Device>, extent: [u32; 2], needs: &Needs, window: bool) -> Result<Self> {
        let make = |name: &str, format| {
            Image::new(device, name, ImageDesc { extent, format, mip_levels: 1, usage: ImageUse::Target })
        };
        let depth = |name: &str| {
            if needs.primary_rays {
                return make(name, Format::R32Float);
            }
            let desc = ImageDesc { extent, format: Format::Depth32, mip_levels: 1, usage: ImageUse::Depth };
            Image::new(device, name, desc)
        };
        let one_texel = |name: &str, format| {
            let desc = ImageDesc { extent: [1, 1], format, mip_levels: 1, usage: ImageUse::Target };
            Image::new(device, name, desc)
        };
        let or_one_texel = |wanted: bool, name: &str, format| {
            if wanted { make(name, format) } else { one_texel(name, format) }
        };
        let pasts = if needs.temporal { 2 } else { 1 };
        let light = needs.direct_light();
        let denoises = needs.temporal && light;
        let brought = denoises && (needs.reflection || needs.refraction);
        let signal = |wanted: bool, name: &str| or_one_texel(wanted, name, Format::Rgba32Float);
        let pair = |wanted: bool, name: &str| -> Result<[Image; 2]> {
            Ok([signal(wanted, name)?, signal(wanted, name)?])
        };
        let filtered = || -> Result<[Image; 3]> {
            let wanted = needs.spatial;
            Ok([
                signal(wanted, "filtered_diffuse")?,
                signal(wanted && !needs.paths, "filtered_specular")?,
                signal(wanted && brought, "filtered_reflected")?,
            ])
        };
        let history = denoises.then(|| -> Result<History> {
            Ok(History {
                diffuse: pair(true, "history_diffuse")?,
                specular: pair(!needs.paths, "history_specular")?,
                reflected: pair(brought, "history_reflected")?,
                image: pair(brought, "history_image")?,
                moments: pair(needs.spatial, "history_moments")?,
                filtered: [filtered()?, filtered()?],
                guide: pair(needs.spatial, "guide")?,
            })
        });
        let shadows = || or_one_texel(needs.known_shadows, "shadows", Format::R32Uint);
        let optional = |wanted: bool, name: &str, format| wanted.then(|| make(name, format)).transpose();
        Ok(Self {
            id: make("gbuffer_id", Format::Rgba32Uint)?,
            normal: (0..pasts)
                .map(|_| make("gbuffer_normal", Format::Rg32Uint))
                .collect::<std::result::Result<_, _>>()?,
            depth: (0..pasts).map(|_| depth("gbuffer_depth")).collect::<std::result::Result<_, _>>()?,
            base_color: make("gbuffer_base_color", Format::Rgba16Float)?,
            material: make("gbuffer_material", Format::Rg16Float)?,
            motion: or_one_texel(needs.motion, "gbuffer_motion", Format::Rg32Float)?,
            emissive: optional(needs.emission, "gbuffer_emissive", Format::Rgba32Float)?,
            direct_diffuse: optional(
                light && (denoises || !needs.paths),
                "direct_diffuse",
                Format::Rgba32Float,
            )?,
            direct_specular: optional(light && !needs.paths, "direct_specular", Format::Rgba32Float)?,
            reflected: signal(brought, "reflected")?,
            reflected_tint: or_one_texel(
                brought || (denoises && needs.paths),
                "reflected_tint",
                Format::Rgba16Float,
            )?,
            shadows: [shadows()?, shadows()?],
            history: history.transpose()?,
            past: None,
            shaded: make("shaded", Format::Rgba32Float)?,
            ray_depth: or_one_texel(
                needs.ray_depth && (needs.paths || needs.secondary_rays()),
                "ray_depth",
                Format::R32Uint,
            )?,
            light_shadow: None,
            display: make("display", Format::Rgba16Float)?,
            window: optional(window, "window", Format::Rgba16Float)?,
        })
    }

    /// What of these images a frame of another size can still use.
    pub(crate) fn into_past(self) -> Option<Past> {
        let Self { normal, depth, history, past, .. } = self;
        past.or(history.map(|history| Past { normal, depth, history }))
    }

    /// Makes what is shown and needed for nothing else, and lets go what is not shown any more.
    pub(crate) fn prepare_shown(&mut self, device: &Arc<Device>, extent: [u32; 2], show: Show) -> Result<()> {
        if show != Show::Shadow {
            self.light_shadow = None;
        } else if self.light_shadow.is_none() {
            let format = Format::Rgba32Float;
            let desc = ImageDesc { extent, format, mip_levels: 1, usage: ImageUse::Target };
            self.light_shadow = Some(Image::new(device, "light_shadow", desc)?);
        }
        Ok(())
    }
}
