//! The error of the view's picture over the time that it took, for as long as the window is open. Enters: the session, once a frame.
//! Leaves: curves for the Error panel. It makes references by letting the view be one for a while.

mod flip;

use std::sync::Arc;

use anyhow::Context;
use caustica_renderer::{Accumulated, ViewSettings};

use self::flip::FlipWatch;
use crate::reference::settings_of_truth;
use crate::session::{Session, ViewCamera};
use crate::worker::Wake;

/// Curves that are kept, the newest.
const CURVES: usize = 16;
/// Samples grow by this share between two points, so that they lie evenly in logarithms.
const GROWTH: f64 = 1.15;

/// What a picture is of: other pipelines of the same can be compared.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Subject {
    revision: u64,
    camera: ViewCamera,
    extent: [u32; 2],
}

/// A measured error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LivePoint {
    /// Samples of the picture.
    pub samples: u64,
    /// Milliseconds on the device since it was begun.
    pub gpu_ms: f64,
    /// The error against the reference, else the noise; a share, sqrt(relMSE).
    pub error: f64,
}

/// How the error of one picture fell.
#[derive(Clone, Debug)]
pub struct LiveCurve {
    /// The way it was made.
    pub name: String,
    /// Of the present scene, from the present camera.
    pub is_present: bool,
    /// Against a reference, not the noise alone.
    pub against_reference: bool,
    /// What put an end to it; empty while it goes on.
    pub ended_by: String,
    /// By samples.
    pub points: Vec<LivePoint>,
    subject: Subject,
}

/// A reference that is being rendered.
#[derive(Clone, Debug)]
struct Making {
    samples: u64,
    subject: Subject,
    before: ViewSettings,
}

/// All curves, and the reference.
#[derive(Debug)]
pub struct ErrorWatch {
    /// Oldest first.
    pub curves: Vec<LiveCurve>,
    /// The error at which no more samples are taken; 0.01 is 1 %.
    pub stop_at: Option<f64>,
    /// Samples of the next reference.
    pub reference_samples: u64,
    /// What was done with the reference last, for the panel.
    pub note: String,
    /// The picture that the last curve is of, counted by resets.
    resets: Option<u64>,
    /// Samples and milliseconds so far.
    so_far: (u64, f64),
    making: Option<Making>,
    /// The reference and what it shows.
    reference: Option<(Arc<Accumulated>, Subject)>,
    /// FLIP against it.
    pub flip: FlipWatch,
}

impl Default for ErrorWatch {
    fn default() -> Self {
        Self {
            curves: Vec::new(),
            stop_at: None,
            reference_samples: 256,
            note: String::new(),
            resets: None,
            so_far: (0, 0.0),
            making: None,
            reference: None,
            flip: FlipWatch::default(),
        }
    }
}

impl ErrorWatch {
    /// Looks at the picture as the last frame left it, and asks for the next measurement.
    pub fn look(&mut self, session: &mut Session) {
        let subject = subject_of(session);
        self.keep_reference(session, subject);
        // A reference is made to its end.
        session.set_stop_at(self.stop_at.filter(|_| self.making.is_none()));
        self.flip.poll();
        let statistics = session.statistics();
        if self.resets != Some(statistics.resets) {
            self.begin(session, subject);
        }
        for curve in &mut self.curves {
            curve.is_present = curve.subject == subject;
        }
        let samples = session.samples();
        let new = samples.saturating_sub(self.so_far.0) as f64;
        self.so_far = (samples, self.so_far.1 + new * session.device_ms().unwrap_or(0.0));
        self.take_point(session);
        let measured =
            self.curves.last().and_then(|curve| curve.points.last()).map_or(0, |point| point.samples);
        if samples + 1 >= ((measured as f64 * GROWTH) as u64).max(measured + 1) {
            session.measure();
        }
    }

    /// A picture was begun anew.
    fn begin(&mut self, session: &Session, subject: Subject) {
        let (settings, statistics) = (session.settings(), session.statistics());
        self.resets = Some(statistics.resets);
        self.so_far = (0, 0.0);
        if let Some(last) = self.curves.last_mut() {
            last.ended_by.clone_from(&statistics.reset_reason);
        }
        let name = match settings.denoise_stills {
            true => format!("{}, denoised", settings.pipeline.name()),
            false => settings.pipeline.name().to_owned(),
        };
        // One that was dragged along has nothing to show, and the newest of its kind counts.
        self.curves
            .retain(|curve| curve.points.len() > 1 && !(curve.subject == subject && curve.name == name));
        let surplus = (self.curves.len() + 1).saturating_sub(CURVES);
        self.curves.drain(..surplus);
        self.curves.push(LiveCurve {
            name,
            is_present: true,
            against_reference: false,
            ended_by: String::new(),
            points: Vec::new(),
            subject,
        });
    }

    fn take_point(&mut self, session: &Session) {
        let Some(found) = session.live_error() else { return };
        let gpu_ms = self.gpu_ms_of(found.samples);
        let Some(curve) = self.curves.last_mut() else { return };
        // Frames that share their past do not tell how far they are from the truth.
        let noise = found.noise.filter(|_| !session.settings().denoise_stills);
        let error = match found.against {
            Some(against) => against.split.total,
            None => noise.map_or(0.0, |noise| noise.error().value),
        };
        let is_new = curve.points.last().is_none_or(|last| last.samples < found.samples);
        let against_reference = found.against.is_some();
        let Some(gpu_ms) = gpu_ms.filter(|_| error > 0.0 && is_new) else { return };
        if curve.against_reference != against_reference {
            // The one is not the continuation of the other.
            curve.points.clear();
            curve.against_reference = against_reference;
        }
        curve.points.push(LivePoint { samples: found.samples, gpu_ms, error });
    }

    /// Milliseconds on the device until the picture had so many samples; `None`: nothing has been rendered.
    pub fn gpu_ms_of(&self, samples: u64) -> Option<f64> {
        let (so_far, ms) = self.so_far;
        (so_far > 0).then(|| ms * samples as f64 / so_far as f64)
    }

    /// Lets the view be the reference until it has so many samples.
    pub fn render_reference(&mut self, session: &mut Session, samples: u64) {
        let before = session.settings().clone();
        session.set_settings(ViewSettings {
            show: before.show,
            exposure_ev: before.exposure_ev,
            tone_map: before.tone_map,
            ..settings_of_truth(&before)
        });
        self.set_reference(session, None);
        self.making = Some(Making { samples, subject: subject_of(session), before });
    }

    /// Ends the making of a reference, as if it had not been begun.
    pub fn cancel_reference(&mut self, session: &mut Session) {
        if let Some(making) = self.making.take() {
            session.set_settings(making.before);
        }
    }

    /// Samples that a reference has and is to have, while one is made.
    pub fn progress(&self, session: &Session) -> Option<(u64, u64)> {
        self.making.as_ref().map(|making| (session.samples().min(making.samples), making.samples))
    }

    /// Compares with this picture of what is shown.
    pub fn set_reference(&mut self, session: &mut Session, picture: Option<Arc<Accumulated>>) {
        self.reference = picture.clone().map(|picture| (picture, subject_of(session)));
        self.flip = FlipWatch::default();
        self.note.clear();
        session.set_reference(picture);
    }

    /// Goes on with a reference that is made; drops one of what is shown no more.
    fn keep_reference(&mut self, session: &mut Session, subject: Subject) {
        if let Some(making) = &self.making {
            if making.subject != subject || session.settings().pipeline != caustica_renderer::Pipeline::Path {
                self.making = None;
                self.note = String::from("The reference was not finished: something else is shown.");
            } else if session.samples() >= making.samples && !session.textures_settle() {
                self.finish_reference(session);
            }
        } else if self.reference.as_ref().is_some_and(|(_, of)| *of != subject) {
            self.set_reference(session, None);
            self.note = String::from("The reference was dropped: something else is shown.");
        }
    }

    /// Begins to measure FLIP of the picture as it is now.
    ///
    /// # Errors
    /// When there is no reference, or the picture cannot be read.
    pub fn measure_flip(&mut self, session: &mut Session, wake: Wake) -> anyhow::Result<()> {
        let (reference, _) = self.reference.as_ref().context("there is no reference to compare with")?;
        let picture = session.read_back()?;
        self.flip.start(Arc::clone(reference), picture, session.settings().exposure_ev.exp2(), wake);
        Ok(())
    }

    fn finish_reference(&mut self, session: &mut Session) {
        let Some(making) = self.making.take() else { return };
        let read = session.read_back();
        session.set_settings(making.before);
        match read {
            Ok(picture) => self.set_reference(session, Some(Arc::new(picture))),
            Err(error) => self.note = format!("The reference was lost: {error:#}"),
        }
    }
}

fn subject_of(session: &Session) -> Subject {
    Subject {
        revision: session.picture_revision(),
        camera: *session.camera(),
        extent: session.picture_extent(),
    }
}
