//! FLIP of the view's picture, on another thread: it takes longer than many a picture. Enters: a picture and its reference. Leaves: a
//! number, some time later.

use std::sync::Arc;

use caustica_renderer::{Accumulated, Radiance, flip_ldr};

use crate::worker::{Answer, Job, Wake};

/// The last picture that was compared, or is being.
#[derive(Debug, Default)]
pub struct FlipWatch {
    job: Option<Job<Result<f64, String>>>,
    /// Samples of that picture.
    samples: u64,
    found: Option<Result<f64, String>>,
}

impl FlipWatch {
    /// Begins to compare a picture, shown with the factor `exposure`, with the reference.
    pub(super) fn start(
        &mut self,
        reference: Arc<Accumulated>,
        picture: Accumulated,
        exposure: f32,
        wake: Wake,
    ) {
        self.samples = picture.samples;
        self.found = None;
        let work = move || {
            let [truth, seen] = [&*reference, &picture].map(|image| Radiance::new(image.extent, &image.mean));
            Ok(flip_ldr(&truth?, &seen?, exposure)?.mean)
        };
        let words = |error: caustica_renderer::RendererError| error.to_string();
        match Job::start("FLIP", wake, move |_| work().map_err(words)) {
            Ok(job) => self.job = Some(job),
            Err(error) => self.found = Some(Err(error.to_string())),
        }
    }

    /// Takes the result over, once it is there.
    pub(super) fn poll(&mut self) {
        match self.job.as_ref().map(Job::poll) {
            None | Some(Answer::Running) => return,
            Some(Answer::Done(found)) => self.found = Some(found),
            Some(Answer::Died) => self.found = Some(Err(String::from("it was not measured"))),
        }
        self.job = None;
    }

    /// Whether a picture is being compared.
    pub fn is_running(&self) -> bool {
        self.job.is_some()
    }

    /// Mean of FLIP, or why there is none, and the samples of the picture.
    pub fn found(&self) -> Option<(&Result<f64, String>, u64)> {
        self.found.as_ref().map(|found| (found, self.samples))
    }
}
