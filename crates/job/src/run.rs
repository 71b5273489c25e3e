use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use std::time::{Duration, Instant};

use film::Film;
use scene::Scene;
use trace::{SimdLevel, Tracer};

/// Set it from anywhere to end a render early; what is there is kept.
#[derive(Clone, Debug, Default)]
pub struct Cancel(Arc<AtomicBool>);

impl Cancel {
    /// Asks the render to end.
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether it was asked to end.
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// How to run.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Stop when this much time has been spent on samples, even if the scene asks for more.
    pub time: Option<Duration>,
    /// Threads; 0 is one per processor.
    pub threads: usize,
    /// Instruction set of the ray intersection.
    pub simd: SimdLevel,
}

/// How far a render is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Event {
    /// Samples of pixels done so far.
    pub done: u64,
    /// Samples of pixels in all, as far as is known (a time limit may end it sooner).
    pub total: u64,
    /// Samples per pixel finished for the whole picture.
    pub passes: u32,
    /// Since the first sample was started.
    pub elapsed: Duration,
    /// Time left by the present rate, or to the time limit.
    pub remaining: Option<Duration>,
    /// Samples of pixels per second so far.
    pub rate: f64,
    /// Relative standard error of the picture, once it can be told.
    pub noise: Option<f64>,
}

/// What came out.
#[derive(Debug)]
pub struct Outcome {
    /// The picture.
    pub film: Film,
    /// Samples per pixel finished for the whole picture.
    pub samples: u32,
    /// Whether it was cancelled.
    pub cancelled: bool,
    /// From the call to the first sample.
    pub startup: Duration,
    /// Spent on samples.
    pub elapsed: Duration,
    /// Rays traced, shadow rays included.
    pub rays: u64,
    /// What the intersection structure came to.
    pub accel: trace::AccelStats,
    /// Instruction set used.
    pub simd: String,
    /// Threads used.
    pub threads: usize,
}

/// Why a render could not run.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RunError {
    /// The picture cannot be held.
    #[error(transparent)]
    Size(#[from] film::SizeError),
    /// The system gives no threads.
    #[error("cannot start {threads} threads: {cause}")]
    Threads {
        /// How many were asked for.
        threads: usize,
        /// What the system says.
        cause: rayon::ThreadPoolBuildError,
    },
    /// Part of the renderer broke: a defect of Cuticle's, not of the scene.
    #[error("the renderer stopped unexpectedly; please report this with the scene that caused it")]
    Broken,
}

/// How long a pass should take at most, so that progress is seen and a time limit is met.
const PASS: Duration = Duration::from_millis(1500);
/// How often progress is told.
const TICK: Duration = Duration::from_millis(200);

/// Renders a scene. `report` is called a few times a second, and once at the end.
///
/// The picture is a function of the scene and the number of samples alone: neither threads nor passes
/// change a bit of it.
///
/// # Errors
/// When the picture does not fit into memory, or no threads can be had.
pub fn render(
    scene: Arc<Scene>,
    options: &Options,
    cancel: &Cancel,
    report: &mut dyn FnMut(&Event),
) -> Result<Outcome, RunError> {
    let begin = Instant::now();
    let mut film = Film::new(scene.film.width, scene.film.height)?;
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(options.threads)
        .thread_name(|i| format!("render {i}"))
        .build()
        .map_err(|cause| RunError::Threads { threads: options.threads, cause })?;
    let pixels = u64::from(film.width()) * u64::from(film.height());
    let samples = scene.render.samples;
    let total = pixels * u64::from(samples);

    let tracer = pool.install(|| Tracer::new(scene, options.simd));
    let startup = begin.elapsed();
    let start = Instant::now();
    let mut passes = 0;
    let mut last =
        Event { done: 0, total, passes: 0, elapsed: Duration::ZERO, remaining: options.time, rate: 0.0, noise: None };
    let broken = std::thread::scope(|scope| {
        let (sender, receiver) = mpsc::channel();
        let (tracer, pool, film) = (&tracer, &pool, &mut film);
        let worker = scope.spawn(move || {
            let mut done = 0;
            while done < samples && !cancel.is_cancelled() {
                let count = next_pass(done, samples, start.elapsed(), options.time);
                if count == 0 {
                    break;
                }
                pool.install(|| tracer.render(film, done, done + count, &cancel.0));
                if cancel.is_cancelled() {
                    break;
                }
                done += count;
                // The receiver lives as long as this scope.
                let _ = sender.send((done, film.noise()));
            }
        });
        loop {
            let (stop, message) = match receiver.recv_timeout(TICK) {
                Ok(message) => (false, Some(message)),
                Err(mpsc::RecvTimeoutError::Timeout) => (false, None),
                Err(mpsc::RecvTimeoutError::Disconnected) => (true, None),
            };
            if let Some((done, noise)) = message {
                passes = done;
                last.passes = done;
                last.noise = noise.is_finite().then_some(noise);
            }
            last.done = tracer.samples();
            last.elapsed = start.elapsed();
            last.rate = last.done as f64 / last.elapsed.as_secs_f64().max(1e-9);
            last.remaining = remaining(&last, options.time);
            report(&last);
            if stop {
                break;
            }
        }
        worker.join().is_err()
    });
    if broken {
        return Err(RunError::Broken);
    }
    Ok(Outcome {
        film,
        samples: passes,
        cancelled: cancel.is_cancelled(),
        startup,
        elapsed: start.elapsed(),
        rays: tracer.rays(),
        accel: tracer.accel().stats(),
        simd: tracer.accel().level().to_string(),
        threads: pool.current_num_threads(),
    })
}

/// How many samples per pixel to take next: as many as fit into a pass and into what is left.
fn next_pass(done: u32, samples: u32, elapsed: Duration, limit: Option<Duration>) -> u32 {
    if done == 0 {
        return 1;
    }
    let each = elapsed.as_secs_f64() / f64::from(done);
    let mut room = PASS.as_secs_f64();
    if let Some(limit) = limit {
        let left = limit.as_secs_f64() - elapsed.as_secs_f64();
        // A pass that would end after the limit is not begun.
        if left < each {
            return 0;
        }
        room = room.min(left);
    }
    // At most doubling: the first pass is a poor guide.
    ((room / each.max(1e-9)) as u32).clamp(1, done).min(samples - done)
}

fn remaining(event: &Event, limit: Option<Duration>) -> Option<Duration> {
    let by_limit = limit.map(|limit| limit.saturating_sub(event.elapsed));
    let by_rate = (event.rate > 0.0)
        .then(|| (event.total.saturating_sub(event.done)) as f64 / event.rate)
        .and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
    match (by_limit, by_rate) {
        (Some(a), Some(b)) => Some(a.min(b)),
        (a, b) => a.or(b),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_grow_to_the_time_they_may_take_and_stop_before_the_limit() {
        let seconds = Duration::from_secs_f64;
        assert_eq!(next_pass(0, 100, Duration::ZERO, None), 1);
        // 0.1 s each: 15 fit into a pass, but growth is by doubling.
        assert_eq!(next_pass(4, 100, seconds(0.4), None), 4);
        assert_eq!(next_pass(40, 100, seconds(4.0), None), 15);
        assert_eq!(next_pass(95, 100, seconds(9.5), None), 5);
        // 2 s each and 1.5 s left: no more.
        assert_eq!(next_pass(4, 100, seconds(8.5), Some(seconds(10.0))), 0);
        assert_eq!(next_pass(2, 100, seconds(4.0), Some(seconds(10.0))), 1);
    }
}
