//! Settings of the picture: environment, pipeline, exposure, sampling. Enters and leaves: the view's settings.

use caustica_renderer::delta::LightId;
use caustica_renderer::{
    NeedsMode, Pipeline, Primary, ReflectionRate, Sampler, Sampling, ShadowRate, Show, ToneMap, ViewSettings,
};
use egui::{DragValue, Slider, Ui};

use super::{Cx, field, section};
use crate::session::Session;

/// Draws the panel.
pub fn ui(cx: &mut Cx<'_>, ui: &mut Ui) {
    section(ui, "Environment", |ui| super::environment::ui(cx, ui));
    let old = cx.session.settings().clone();
    let mut new = old.clone();
    section(ui, "Picture", |ui| picture(cx.session, ui, &mut new));
    section(ui, "Sampling", |ui| sampling(ui, &mut new));
    section(ui, "While moving", |ui| moving(cx, ui, &mut new));
    if new != old {
        cx.session.set_settings(new);
    }
}

/// A menu of pipelines.
pub fn pipeline_menu(ui: &mut Ui, pipeline: &mut Pipeline) {
    egui::ComboBox::from_id_salt("pipeline").selected_text(pipeline_name(*pipeline)).width(104.0).show_ui(
        ui,
        |ui| {
            for choice in Pipeline::ALL {
                ui.selectable_value(pipeline, choice, pipeline_name(choice))
                    .on_hover_text(pipeline_tip(choice));
            }
        },
    );
}

/// A menu of what is shown.
pub fn show_menu(ui: &mut Ui, show: &mut Show) {
    let name = Show::ALL.iter().find(|(choice, _)| choice == show).map_or("", |(_, name)| name);
    egui::ComboBox::from_id_salt("show")
        .selected_text(name)
        .width(128.0)
        .height(420.0)
        .show_ui(ui, |ui| {
            for (choice, name) in Show::ALL {
                ui.selectable_value(show, choice, name).on_hover_text(choice.meaning());
            }
        })
        .response
        .on_hover_text(show.meaning());
}

/// A menu of the lights whose shadow can be shown; `None` is the first that shines.
pub fn light_menu(session: &Session, ui: &mut Ui, light: &mut Option<LightId>) {
    let lights = session.light_names();
    let chosen = lights.iter().find(|(id, _)| light.is_none_or(|light| light == *id));
    let name = chosen.map_or("no light", |(_, name)| name);
    egui::ComboBox::from_id_salt("shadow of")
        .selected_text(name)
        .width(104.0)
        .show_ui(ui, |ui| {
            for (id, name) in &lights {
                ui.selectable_value(light, Some(*id), name);
            }
        })
        .response
        .on_hover_text("The light whose shadow is shown");
}

fn pipeline_name(pipeline: Pipeline) -> String {
    let name = pipeline.name();
    let mut letters = name.chars();
    letters
        .next()
        .map(|first| first.to_uppercase().collect::<String>() + letters.as_str())
        .unwrap_or_default()
}

fn pipeline_tip(pipeline: Pipeline) -> &'static str {
    match pipeline {
        Pipeline::Raster => "Rasterised surfaces, deferred shading, no rays",
        Pipeline::Hybrid => "Rasterised surfaces, ray-traced shadows, reflections and refractions",
        Pipeline::Raytraced => "The same with ray-traced first surfaces",
        Pipeline::Path => "Unbiased path tracing: slow, and what the others are measured by",
    }
}

fn picture(session: &Session, ui: &mut Ui, settings: &mut ViewSettings) {
    field(ui, "Pipeline", "How the picture is made", |ui| pipeline_menu(ui, &mut settings.pipeline));
    if settings.pipeline == Pipeline::Hybrid {
        field(ui, "First surfaces", "How they are found; automatic is what is faster on this device", |ui| {
            egui::ComboBox::from_id_salt("primary").selected_text(primary_name(settings.primary)).show_ui(
                ui,
                |ui| {
                    for choice in Primary::ALL {
                        ui.selectable_value(&mut settings.primary, choice, primary_name(choice));
                    }
                },
            );
        });
    }
    field(ui, "Show", "The finished picture or a step on the way", |ui| show_menu(ui, &mut settings.show));
    if settings.show == Show::Shadow {
        field(ui, "Light", "The light whose shadow is shown", |ui| {
            light_menu(session, ui, &mut settings.show_light);
        });
    }
    field(ui, "Exposure", "Stops: each doubles the light. The picture is not rendered anew", |ui| {
        ui.spacing_mut().slider_width = (ui.available_width() - 96.0).clamp(32.0, 160.0);
        ui.add(
            Slider::new(&mut settings.exposure_ev, -10.0..=10.0)
                .clamping(egui::SliderClamping::Edits)
                .max_decimals(2)
                .suffix(" EV"),
        );
    });
    field(ui, "Tone map", "How radiance becomes a colour that a screen can show", |ui| {
        egui::ComboBox::from_id_salt("tone map").selected_text(tone_name(settings.tone_map)).show_ui(
            ui,
            |ui| {
                for choice in ToneMap::ALL {
                    ui.selectable_value(&mut settings.tone_map, choice, tone_name(choice));
                }
            },
        );
    });
}

fn primary_name(primary: Primary) -> &'static str {
    match primary {
        Primary::Auto => "Automatic",
        Primary::Raster => "Raster",
        Primary::Rays => "Rays",
    }
}

fn tone_name(tone_map: ToneMap) -> &'static str {
    match tone_map {
        ToneMap::Linear => "Linear",
        ToneMap::Aces => "ACES",
        ToneMap::Agx => "AgX",
        ToneMap::Neutral => "Neutral",
    }
}

fn sampler_name(sampler: Sampler) -> &'static str {
    match sampler {
        Sampler::Sobol => "Sobol",
        Sampler::Halton => "Halton",
        Sampler::Hammersley => "Hammersley",
        Sampler::Independent => "Independent",
        Sampler::BlueNoise => "Blue noise",
    }
}

fn sampler_tip(sampler: Sampler) -> String {
    match sampler {
        Sampler::Sobol => {
            String::from("Even at every number of samples that is a power of two, and nearly so between")
        }
        Sampler::Halton => {
            String::from("Even at any number of samples; large bases need many, so Sobol is mostly better")
        }
        Sampler::Hammersley => format!(
            "Even once a set is complete, noisy before. Here, where nobody knows how many samples there will be, a set \
             has {} of them; caustica render makes it for --samples",
            2 * Sampling::UNKNOWN_SET
        ),
        Sampler::Independent => {
            String::from("Independent numbers: the noise that the others are measured by")
        }
        Sampler::BlueNoise => String::from(
            "Sobol whose errors cancel between neighbouring pixels: fine grain at the first samples",
        ),
    }
}

fn sampling(ui: &mut Ui, settings: &mut ViewSettings) {
    field(ui, "Sampler", "Where random numbers come from. Each leads to the same picture", |ui| {
        let name = sampler_name(settings.sampler);
        egui::ComboBox::from_id_salt("sampler").selected_text(name).show_ui(ui, |ui| {
            for choice in Sampler::ALL {
                ui.selectable_value(&mut settings.sampler, choice, sampler_name(choice))
                    .on_hover_text(sampler_tip(choice));
            }
        });
    });
    field(ui, "Lights a pixel", "All lights when there are at most this many, else a random choice", |ui| {
        ui.add(DragValue::new(&mut settings.light_samples).range(1..=64).speed(0.1));
    });
    field(ui, "Shadow rays", "For each light and pixel of a frame; more is smoother and slower", |ui| {
        ui.add(DragValue::new(&mut settings.shadow_rays).range(1..=64).speed(0.1));
    });
    field(ui, "Depth", "Reflections and refractions after the first surface", |ui| {
        ui.add(DragValue::new(&mut settings.max_depth).range(0..=64).speed(0.1));
    });
    path_depth(ui, settings);
    field(ui, "Rough limit", "Surfaces rougher than this reflect the environment only", |ui| {
        ui.add(DragValue::new(&mut settings.reflection_roughness_max).range(0.0..=1.0).speed(0.005));
    });
    field(ui, "Glass shadows", "Light passes glass, tinted and unbent, or stops at it", |ui| {
        let mut tinted = !settings.opaque_glass_shadows;
        ui.checkbox(&mut tinted, "tinted");
        settings.opaque_glass_shadows = !tinted;
    });
    field(ui, "Seed", "Of all random numbers: the same seed gives the same picture", |ui| {
        ui.add(DragValue::new(&mut settings.seed).speed(0.1));
    });
    field(ui, "Left out", "Do not run what this scene does not need; the picture stays the same", |ui| {
        let mut lean = settings.needs == NeedsMode::Auto;
        ui.checkbox(&mut lean, "what is not needed");
        settings.needs = if lean { NeedsMode::Auto } else { NeedsMode::All };
    });
}

fn path_depth(ui: &mut Ui, settings: &mut ViewSettings) {
    field(
        ui,
        "Path depth",
        "Bounces after the first surface in the path tracer; without a limit chance ends each path, and the mean is exact",
        |ui| {
            let mut limited = settings.path_depth.is_some();
            ui.checkbox(&mut limited, "at most");
            settings.path_depth = limited.then(|| settings.path_depth.unwrap_or(settings.max_depth));
            if let Some(depth) = &mut settings.path_depth {
                ui.add(DragValue::new(depth).range(0..=1024).speed(0.1));
            }
        },
    );
    field(
        ui,
        "Rough metal",
        "In the path tracer, reflect the light too that rough surfaces scatter more than once; off is glTF to the letter",
        |ui| {
            ui.checkbox(&mut settings.multiple_scattering, "scatters repeatedly");
        },
    );
}

fn moving(cx: &mut Cx<'_>, ui: &mut Ui, settings: &mut ViewSettings) {
    field(ui, "Denoise", "Use earlier frames while something moves", |ui| {
        ui.checkbox(&mut settings.temporal, "over time");
        ui.add_enabled(settings.temporal, egui::Checkbox::new(&mut settings.spatial, "over space"));
    });
    field(
        ui,
        "Reflections",
        "Trace them in one pixel of four while they are denoised: faster, less sharp",
        |ui| {
            let mut half = settings.reflection_rate == ReflectionRate::Half;
            ui.add_enabled(settings.temporal, egui::Checkbox::new(&mut half, "at half the rate"));
            settings.reflection_rate = if half { ReflectionRate::Half } else { ReflectionRate::Full };
        },
    );
    field(
        ui,
        "Shadows",
        "Trace them where light and shadow meet, and in one pixel of eight, while the camera moves: faster",
        |ui| {
            let mut penumbra = settings.shadow_rate == ShadowRate::Penumbra;
            ui.add_enabled(settings.temporal, egui::Checkbox::new(&mut penumbra, "in penumbrae alone"));
            settings.shadow_rate = if penumbra { ShadowRate::Penumbra } else { ShadowRate::Full };
        },
    );
    let config = &mut cx.state.config;
    field(
        ui,
        "Resolution",
        "Lower it while something moves, so that a frame takes at most this long",
        |ui| {
            ui.checkbox(&mut config.adaptive, "");
            let drag = DragValue::new(&mut config.target_frame_ms)
                .range(4.0..=500.0)
                .speed(0.5)
                .max_decimals(0)
                .suffix(" ms");
            ui.add_enabled(config.adaptive, drag);
        },
    );
}
