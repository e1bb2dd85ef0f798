//! What no compiler sees, as each file is right by itself: shaders that fit neither the host nor each other are named, and the last good
//! picture stays.

use caustica_renderer::shader::ShaderStatus;
use caustica_renderer::{NeedsMode, Pipeline, ViewSettings};
use caustica_tests::studio::Studio;

use super::{Folder, Save, picture, studio, until};

/// Saves a text in which something was replaced: it is refused in these words, and the picture stays.
fn assert_refused(folder: &Folder, studio: &mut Studio, file: &str, what: (&str, &str), words: &[&str]) {
    let text = folder.text(file);
    let wrong = text.replacen(what.0, what.1, 1);
    assert_ne!(text, wrong, "{file} has no {}", what.0);
    let good = picture(studio);
    folder.save(file, &wrong, Save::InPlace);
    let status = until(studio, file, |status| !status.faults.is_empty());
    assert!(picture(studio) == good, "{file}: another picture");
    folder.save(file, &text, Save::InPlace);
    until(studio, file, |status| status.faults.is_empty());
    let said: String = status.faults.iter().map(|fault| format!("{fault}\n")).collect();
    assert!(words.iter().all(|word| said.contains(word)), "{file}: {said}");
}

/// What no compiler sees, as each file is right by itself.
#[test]
fn what_does_not_fit_the_host_or_the_other_stages_is_named() {
    let folder = Folder::new();
    let way = ViewSettings { needs: NeedsMode::All, ..ViewSettings::default() };
    let mut studio = studio(&folder, way);
    for (file, what, words) in [
        (
            "passes/rays/surface.rmiss",
            (
                "layout(location = 0) rayPayloadInEXT SurfacePayload payload;",
                "struct Other { float t_m; uint more; };\nlayout(location = 0) rayPayloadInEXT Other payload;\n",
            ),
            &["surface.rmiss:", "ray payload: expected", "found"][..],
        ),
        (
            "passes/post/post.comp",
            ("rgba16f", "rgba32f"),
            &[
                "post.comp:",
                "binding 'display': expected an image of Rgba16Float, found Rgba32Float",
                "rgba32f",
            ],
        ),
        (
            "passes/post/post.comp",
            ("local_size_x = 8, ", "local_size_x = 16, "),
            &[
                "post.comp:6:8: workgroup size: the host expects 8 x 8 x 1, found 16 x 8 x 1\n    layout(local_size_x = 16, ",
            ],
        ),
        (
            "passes/post/post.comp",
            (
                "void main() {",
                "void main() {\n    int big[100000000];\n    big[gl_LocalInvocationIndex] = 1;",
            ),
            &[
                "variable 'big': expected at most 524288 bytes",
                "found 400000000\n        int big[100000000];",
            ],
        ),
        (
            "passes/rays/surface.rchit",
            (
                "hitAttributeEXT vec2 barycentric;",
                "struct Wide { vec2 at; vec2 more; };\nhitAttributeEXT Wide wide;\nvec2 barycentric = wide.at;",
            ),
            &["surface.rchit:", "hit attribute: expected float32x2, found {float32x2, float32x2}"],
        ),
        (
            "passes/post/post.comp",
            (
                "writeonly image2D display;",
                "writeonly image2DArray display;\n#define imageStore(i, at, value) imageStore(i, ivec3(at, 0), value)",
            ),
            &["post.comp:", "'display': expected a two-dimensional image"],
        ),
        (
            "passes/post/post.comp",
            (
                "layout(local_size_x = 8, ",
                "#extension GL_EXT_shader_realtime_clock : require\nuvec2 now = clockRealtime2x32EXT();\nlayout(local_size_x = 8, ",
            ),
            &["post.comp:", "capability ShaderClockKHR: devices are opened without it"],
        ),
        (
            "passes/post/post.comp",
            ("void main() {", "#include \"./lib/color.glsl\"\nvoid main() {"),
            &["post.comp:", "without '.', '..' or empty parts"],
        ),
    ] {
        assert_refused(&folder, &mut studio, file, what, words);
    }
}

/// What rasterised stages hand on.
#[test]
fn what_a_fragment_shader_takes_and_writes_is_held_against_what_there_is() {
    let folder = Folder::new();
    let mut studio = studio(&folder, ViewSettings { pipeline: Pipeline::Raster, ..ViewSettings::default() });
    for (file, what, words) in [
        (
            "passes/gbuffer/visibility.frag",
            (
                "flat in uint in_instance_slot;",
                "flat in vec4 in_slot;\nuint in_instance_slot = uint(in_slot.x);",
            ),
            &["visibility.frag:", "input 'in_slot' at location 0: expected u32", "found vec4<f32>"][..],
        ),
        (
            "passes/gbuffer/visibility.frag",
            ("out uvec4 out_id;", "out vec4 more;\n#define out_id more"),
            &["visibility.frag:", "'more' at location 0: expected u32 for Rgba32Uint, found vec4<f32>"],
        ),
    ] {
        assert_refused(&folder, &mut studio, file, what, words);
    }
}

/// What is wrong from the start on is told, and the built-in shaders are shown.
#[test]
fn what_does_not_fit_from_the_start_on_is_replaced_by_the_built_in_shaders() {
    let folder = Folder::new();
    let way = || ViewSettings { pipeline: Pipeline::Raster, ..ViewSettings::default() };
    let good = picture(&mut studio(&folder, way()));
    for (file, what, words) in [
        (
            "passes/post/post.comp",
            ("display", "displayx"),
            "binding 'displayx': expected one of what the host gives",
        ),
        (
            "passes/post/post.comp",
            ("local_size_x = 8, ", "local_size_x = 4, "),
            "workgroup size: the host expects",
        ),
        ("passes/post/post.comp", ("rgba16f", "rgba32f"), "expected an image of Rgba16Float"),
        (
            "passes/gbuffer/visibility.frag",
            ("location = 0) flat", "location = 3) flat"),
            "at location 3: expected nothing",
        ),
    ] {
        let text = folder.text(file);
        folder.save(
            file,
            &text.replace(what.0, what.1).replace("displayx_color", "display_color"),
            Save::InPlace,
        );
        let mut studio = studio(&folder, way());
        assert!(picture(&mut studio) == good, "{file}: {words}");
        let says =
            |status: &ShaderStatus| status.faults.iter().any(|fault| fault.to_string().contains(words));
        until(&mut studio, words, says);
        folder.save(file, &text, Save::InPlace);
        until(&mut studio, file, |status| status.faults.is_empty());
        assert!(picture(&mut studio) == good, "{file}: mended");
    }
}
