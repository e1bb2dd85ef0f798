//! The colour spaces of FLIP. In and out: one colour. Linear RGB has the primaries of Rec.709 and white at D65.

/// Linear RGB to CIE XYZ, row by row, as IEC 61966-2-1 gives the primaries, with white summing up exactly.
const XYZ_FROM_RGB: [[f32; 3]; 3] = [
    [10_135_552.0 / 24_577_794.0, 8_788_810.0 / 24_577_794.0, 4_435_075.0 / 24_577_794.0],
    [2_613_072.0 / 12_288_897.0, 8_788_810.0 / 12_288_897.0, 887_015.0 / 12_288_897.0],
    [1_425_312.0 / 73_733_382.0, 8_788_810.0 / 73_733_382.0, 70_074_185.0 / 73_733_382.0],
];
/// Below its cube CIE L*a*b* is linear.
const DELTA: f32 = 6.0 / 29.0;
/// Hunt's effect: at lightness L colours count as much as this times L.
const HUNT: f32 = 0.01;

fn xyz_by_white(rgb: [f32; 3]) -> [f32; 3] {
    XYZ_FROM_RGB.map(|row| {
        let white: f32 = row.iter().sum();
        row.iter().zip(rgb).map(|(weight, c)| weight * c).sum::<f32>() / white
    })
}

/// Linear RGB to the opponent space YCxCz, a linear L*a*b* (Flohr et al. 1993).
pub(super) fn opponent_of(rgb: [f32; 3]) -> [f32; 3] {
    let [x, y, z] = xyz_by_white(rgb);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// The way back.
pub(super) fn rgb_of_opponent([y, cx, cz]: [f32; 3]) -> [f32; 3] {
    let y = (y + 16.0) / 116.0;
    let by_white = [y + cx / 500.0, y, y - cz / 200.0];
    let white = XYZ_FROM_RGB.map(|row| row.iter().sum::<f32>());
    let xyz = [0, 1, 2].map(|i| by_white[i] * white[i]);
    let rows = XYZ_FROM_RGB.map(glam::Vec3::from);
    let rgb_from_xyz = glam::Mat3::from_cols(rows[0], rows[1], rows[2]).transpose().inverse();
    (rgb_from_xyz * glam::Vec3::from(xyz)).to_array()
}

/// Linear RGB to CIE L*a*b*, with a* and b* weaker where it is dark.
pub(super) fn lab_of_hunt(rgb: [f32; 3]) -> [f32; 3] {
    let [x, y, z] = xyz_by_white(rgb).map(|value| {
        if value > DELTA.powi(3) { value.cbrt() } else { value / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
    });
    let lightness = 116.0 * y - 16.0;
    [lightness, HUNT * lightness * 500.0 * (x - y), HUNT * lightness * 200.0 * (y - z)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spaces_are_those_of_the_books() {
        let close = |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 2e-3);
        assert!(close(opponent_of([1.0; 3]), [100.0, 0.0, 0.0]));
        // L*a*b* of the red of Rec.709 is 53.24, 80.09, 67.20.
        let [l, a, b] = lab_of_hunt([1.0, 0.0, 0.0]);
        assert!(
            close([l, a / (HUNT * l), b / (HUNT * l)].map(|v| v * 1e-2), [0.5324, 0.8009, 0.6720]),
            "{l} {a} {b}"
        );
        for rgb in [[0.2, 0.5, 0.7], [1.0, 0.0, 0.3]] {
            assert!(close(rgb_of_opponent(opponent_of(rgb)), rgb));
        }
    }
}
