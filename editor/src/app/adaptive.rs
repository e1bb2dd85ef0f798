//! The resolution of the view while something moves. Enters: measured milliseconds, whether something moves.
//! Leaves: by what the device pixels are divided, 1 when everything is still. It knows no renderer.

use std::time::{Duration, Instant};

/// Coarsest picture: one in so many pixels in each direction.
const COARSEST: u32 = 4;
/// The picture is full again after so long without a move.
const STILL_AFTER: Duration = Duration::from_millis(180);
/// Frames of one size before a measurement is trusted: figures arrive two frames late.
const SETTLED_FRAMES: u32 = 3;
/// A finer picture must fit into this share of the target, or the size would swing to and fro.
const REFINE_BELOW: f64 = 0.75;

/// Follows the frame time.
#[derive(Debug)]
pub struct AdaptiveResolution {
    divisor: u32,
    moved: Option<Instant>,
    /// Milliseconds of a frame for each million pixels, smoothed.
    ms_per_megapixel: Option<f64>,
    pixels: f64,
    frames_of_this_size: u32,
}

impl Default for AdaptiveResolution {
    fn default() -> Self {
        Self { divisor: 1, moved: None, ms_per_megapixel: None, pixels: 0.0, frames_of_this_size: 0 }
    }
}

impl AdaptiveResolution {
    /// The divisor for the next frame of a view with `full_px`; `target_ms` `None`: always full.
    pub fn next(&mut self, now: Instant, moving: bool, full_px: [u32; 2], target_ms: Option<f64>) -> u32 {
        if moving {
            self.moved = Some(now);
        }
        let still = self.moved.is_none_or(|moved| now.duration_since(moved) > STILL_AFTER);
        self.divisor = match (target_ms, self.ms_per_megapixel) {
            (Some(target), Some(cost)) if !still => choose(self.divisor, full_px, cost, target),
            _ => 1,
        };
        let pixels = pixels_at(full_px, self.divisor);
        if pixels == self.pixels {
            self.frames_of_this_size += 1;
        } else {
            self.frames_of_this_size = 0;
            self.pixels = pixels;
        }
        self.divisor
    }

    /// Takes in what the newest finished frame took.
    pub fn measured(&mut self, ms: f64) {
        if self.frames_of_this_size < SETTLED_FRAMES || ms <= 0.0 || self.pixels <= 0.0 {
            return;
        }
        let cost = ms / (self.pixels * 1e-6);
        let smoothed = self.ms_per_megapixel.map_or(cost, |old| old + (cost - old) * 0.3);
        self.ms_per_megapixel = smoothed.is_finite().then_some(smoothed);
    }
}

fn pixels_at([width, height]: [u32; 2], divisor: u32) -> f64 {
    f64::from(width.div_ceil(divisor)) * f64::from(height.div_ceil(divisor))
}

/// The finest picture that fits the target; the present one is kept until it misses or a finer one fits well.
fn choose(present: u32, full_px: [u32; 2], ms_per_megapixel: f64, target_ms: f64) -> u32 {
    let ms = |divisor: u32| pixels_at(full_px, divisor) * 1e-6 * ms_per_megapixel;
    let limit = |divisor: u32| if divisor < present { target_ms * REFINE_BELOW } else { target_ms };
    (1..COARSEST).find(|&divisor| ms(divisor) <= limit(divisor)).unwrap_or(COARSEST)
}

#[cfg(test)]
mod tests {
    use super::*;

    const FULL: [u32; 2] = [1280, 720];

    fn run(
        resolution: &mut AdaptiveResolution,
        start: Instant,
        frames: u32,
        moving: bool,
        ms_full: f64,
    ) -> u32 {
        let mut divisor = 1;
        for frame in 0..frames {
            let now = start + Duration::from_millis(u64::from(frame) * 20);
            divisor = resolution.next(now, moving, FULL, Some(33.0));
            resolution.measured(ms_full * pixels_at(FULL, divisor) / pixels_at(FULL, 1));
        }
        divisor
    }

    #[test]
    fn a_slow_device_gets_fewer_pixels_while_moving_and_all_when_still() {
        let mut resolution = AdaptiveResolution::default();
        let start = Instant::now();
        assert_eq!(run(&mut resolution, start, 10, false, 120.0), 1);
        assert_eq!(run(&mut resolution, start + Duration::from_secs(1), 10, true, 120.0), 2);
        assert_eq!(run(&mut resolution, start + Duration::from_secs(2), 20, false, 120.0), 1);
        assert_eq!(run(&mut resolution, start + Duration::from_secs(3), 10, true, 2000.0), COARSEST);
    }

    #[test]
    fn a_fast_device_stays_full() {
        let mut resolution = AdaptiveResolution::default();
        assert_eq!(run(&mut resolution, Instant::now(), 30, true, 4.0), 1);
    }

    #[test]
    fn near_the_limit_the_size_does_not_swing() {
        assert_eq!(choose(1, FULL, 33.0 / 0.9216, 33.0), 1);
        assert_eq!(choose(2, FULL, 31.0 / 0.9216, 33.0), 2, "full would only just fit");
        assert_eq!(choose(2, FULL, 20.0 / 0.9216, 33.0), 1);
    }

    #[test]
    fn switched_off_it_is_always_full() {
        let mut resolution =
            AdaptiveResolution { ms_per_megapixel: Some(1e4), ..AdaptiveResolution::default() };
        assert_eq!(resolution.next(Instant::now(), true, FULL, None), 1);
    }
}
