//! How time goes on while an animation plays. Enters: seconds that have passed. Leaves: the time to show. Pure
//! arithmetic: it reads no clock and touches no document.

/// Frames of a second that steps and figures count in; it is that of the files, not of the screen.
pub const FRAMES_PER_SECOND: f64 = 24.0;
/// Longest time that one frame of the screen moves on, seconds: what stalled for longer goes on where it stood.
const LONGEST_STEP_S: f64 = 1.0;

/// The state of the player.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Playback {
    /// Whether time goes on.
    pub playing: bool,
    /// Seconds of the animation a second; negative: backwards.
    pub speed: f64,
    /// Past the end it begins again.
    pub looping: bool,
}

impl Default for Playback {
    fn default() -> Self {
        Self { playing: false, speed: 1.0, looping: true }
    }
}

impl Playback {
    /// The time after `dt_s` more seconds, between 0 and `duration_s`. At the end of its way a player that does not loop
    /// stops.
    pub fn advance(&mut self, time_s: f64, duration_s: f64, dt_s: f64) -> f64 {
        if !self.playing {
            return time_s;
        }
        let next_s = time_s + dt_s.clamp(0.0, LONGEST_STEP_S) * self.speed;
        if (0.0..=duration_s).contains(&next_s) {
            return next_s;
        }
        if self.looping && duration_s > 0.0 {
            return next_s.rem_euclid(duration_s);
        }
        self.playing = false;
        if next_s < 0.0 { 0.0 } else { duration_s }
    }

    /// Begins to play; where there is nothing left in its direction, from the other end.
    pub fn start(&mut self, time_s: f64, duration_s: f64) -> f64 {
        self.playing = true;
        match self.speed < 0.0 {
            true if time_s <= 0.0 => duration_s,
            false if time_s >= duration_s => 0.0,
            _ => time_s,
        }
    }
}

/// The time `frames` whole frames further on, within the animation: from between two frames to the next one.
pub fn step(time_s: f64, duration_s: f64, frames: f64) -> f64 {
    let frame = time_s * FRAMES_PER_SECOND;
    // A time that is on a frame but for its last digits counts as on it.
    let nearest = frame.round();
    let on_frame = (frame - nearest).abs() < 1e-6;
    let from = match frames < 0.0 {
        _ if on_frame => nearest,
        true => frame.ceil(),
        false => frame.floor(),
    };
    ((from + frames) / FRAMES_PER_SECOND).clamp(0.0, duration_s.max(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn playing(speed: f64, looping: bool) -> Playback {
        Playback { playing: true, speed, looping }
    }

    #[test]
    fn time_goes_on_at_its_speed_while_it_plays() {
        assert_eq!(playing(1.0, true).advance(0.25, 2.0, 0.5), 0.75);
        assert_eq!(playing(0.5, true).advance(0.25, 2.0, 0.5), 0.5);
        assert_eq!(playing(-1.0, true).advance(1.0, 2.0, 0.25), 0.75);
        assert_eq!(Playback::default().advance(0.25, 2.0, 0.5), 0.25, "paused");
    }

    #[test]
    fn a_loop_wraps_at_both_ends() {
        let mut player = playing(1.0, true);
        assert_eq!(player.advance(1.75, 2.0, 0.5), 0.25);
        assert_eq!(player.advance(1.75, 2.0, 0.25), 2.0, "the end itself is shown");
        player.speed = -1.0;
        assert_eq!(player.advance(0.25, 2.0, 0.5), 1.75);
        player.speed = 4.0;
        assert_eq!(player.advance(0.0, 0.75, 1.0), 0.25, "several times round");
        assert!(player.playing);
    }

    #[test]
    fn without_a_loop_it_stops_at_the_end() {
        let mut player = playing(1.0, false);
        assert_eq!((player.advance(1.75, 2.0, 0.5), player.playing), (2.0, false));
        let mut back = playing(-2.0, false);
        assert_eq!((back.advance(0.25, 2.0, 0.5), back.playing), (0.0, false));
        let mut instant = playing(1.0, true);
        assert_eq!((instant.advance(0.0, 0.0, 0.5), instant.playing), (0.0, false), "a clip of one key");
    }

    #[test]
    fn what_stalled_does_not_leap() {
        assert_eq!(playing(1.0, true).advance(0.0, 100.0, 30.0), LONGEST_STEP_S);
        assert_eq!(playing(1.0, true).advance(1.0, 100.0, -5.0), 1.0, "a clock that was put back");
    }

    #[test]
    fn starting_at_the_end_starts_over() {
        let mut player = Playback::default();
        assert_eq!((player.start(2.0, 2.0), player.playing), (0.0, true));
        assert_eq!(player.start(0.5, 2.0), 0.5);
        player.speed = -1.0;
        assert_eq!(player.start(0.0, 2.0), 2.0);
        assert_eq!(player.start(2.0, 2.0), 2.0);
    }

    #[test]
    fn steps_go_from_frame_to_frame() {
        let frame = |n: f64| n / FRAMES_PER_SECOND;
        assert_eq!(step(0.0, 2.0, 1.0), frame(1.0));
        assert_eq!(step(frame(5.0), 2.0, 1.0), frame(6.0));
        assert_eq!(step(frame(5.0), 2.0, -1.0), frame(4.0));
        assert_eq!(step(frame(5.4), 2.0, 1.0), frame(6.0));
        assert_eq!(step(frame(5.4), 2.0, -1.0), frame(5.0));
        assert_eq!(step(0.0, 2.0, -1.0), 0.0);
        assert_eq!(step(2.0, 2.0, 1.0), 2.0);
        let far = (0..1000).fold(0.0, |time_s, _| step(time_s, 100.0, 1.0));
        assert_eq!(far, frame(1000.0), "nothing adds up");
    }
}
