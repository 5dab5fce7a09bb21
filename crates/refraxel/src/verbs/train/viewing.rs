//! The live page of a training: what it is told, and what it may ask.

use super::evidence::EVIDENCE;
use crate::exit::{Exit, Failure, OrExit};
use crate::locked::locked;
use crate::progress::Show;
use crate::sentences::{phase_name, sentence, task_name};
use crate::verbs::interrupts::{LOOK, interrupted};
use crate::verbs::view;
use crate::viewer::{LAST_WORDS, Orders, Painter, Scene, Server, Training, Wish};
use refraxel_train::events::{Event, Task};
use refraxel_train::session::{Handle, Session, Stop};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex};
use std::thread;
use std::time::{Duration, Instant};

/// Share of the time that the painter may work beside a training.
const SHARE: f64 = 0.12;
/// Least time between two copies of the run.
const RENEW: Duration = Duration::from_secs(5);
/// The painter takes a copy over in a time of which this many lie between two copies.
const REST: f64 = 25.0;
/// Least time between two lines about the progress of a long phase.
const LINES: Duration = Duration::from_millis(500);
/// Longest time that a program which ends waits for pages to have the last picture.
const LAST_PICTURE: Duration = Duration::from_secs(10);

const WAITS: &str = "waits at the next record";

/// The page of a training.
pub struct Viewing {
    orders: Orders,
    handle: Handle,
    wishes: Arc<Wishes>,
    run: PathBuf,
    /// Steps in all; `None` where the time counts.
    steps: Option<u64>,
    /// The training was stopped so that it waits.
    stopped_to_wait: bool,
    last_line: Instant,
    /// Pages know that the training has ended.
    has_ended: bool,
}

/// What the training shall do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Course {
    #[default]
    GoOn,
    Wait,
    /// Save and end; no later wish changes that.
    End,
}

/// What pages wish.
#[derive(Default)]
struct Wishes {
    course: Mutex<Course>,
    changed: Condvar,
    /// The training has ended: no copies of it are shown any more.
    ended: Mutex<bool>,
}

impl Wishes {
    /// Takes a wish, unless the training shall end already; whether that changes anything.
    fn set(&self, wished: Course) -> bool {
        let mut course = locked(&self.course);
        let is_new = *course != wished && *course != Course::End;
        if is_new {
            *course = wished;
            self.changed.notify_all();
        }
        is_new
    }
}

impl Viewing {
    /// Opens the page on a server that listens already, and says where.
    pub fn start(server: Server, run: &Path, session: &Session, show: Show) -> Self {
        let (handle, wishes) = (session.handle(), Arc::new(Wishes::default()));
        let scene = Scene::new(view::name(run), session.snapshot(), Some(session.data()));
        let photographs = Arc::clone(scene.photographs());
        let (painter, orders) = Painter::new(scene, SHARE);
        show.say(&format!("live view: {}", server.url()));
        let (asked, by, told) = (Arc::clone(&wishes), handle.clone(), orders.clone());
        let control = move |wish| match wish {
            Wish::Stop => {
                asked.set(Course::End);
                by.cancel();
            }
            Wish::Pause(paused) => {
                if asked.set(if paused { Course::Wait } else { Course::GoOn }) {
                    told.tell_now(state(paused, if paused { WAITS } else { "continues" }));
                }
            }
        };
        server.start(orders.clone(), photographs, Some(Arc::new(control)));
        thread::spawn(|| painter.work());
        let (copies, until, shown) = (handle.clone(), Arc::clone(&wishes), orders.clone());
        thread::spawn(move || renew(&copies, &until, &shown));
        let length = &session.options().run;
        Self {
            orders,
            handle,
            wishes,
            run: run.to_owned(),
            steps: (length.minutes <= 0.0).then_some(length.steps),
            stopped_to_wait: false,
            last_line: Instant::now(),
            has_ended: false,
        }
    }

    /// Tells the page what happens. A wish to wait is fulfilled between two steps, so that no long phase is lost.
    pub fn tell(&mut self, event: &Event) {
        match event {
            Event::Record(record) => {
                self.orders.tell(Training::Record {
                    step: record.step,
                    steps: self.steps,
                    progress: record.progress,
                    train_psnr: Some(record.train_psnr).filter(|psnr| psnr.is_finite()),
                    val_psnr: record.val_psnr,
                    phase: phase_name(record.phase),
                });
                let course = *locked(&self.wishes.course);
                self.tell_state(course, "");
                if course != Course::GoOn {
                    self.stopped_to_wait = course == Course::Wait;
                    self.handle.cancel();
                }
            }
            // Thousandths of the training are no steps, and records count those.
            Event::Progress { task: Task::Training, .. } => {}
            Event::Progress { task, done, total } => self.tell_progress(task_name(*task), *done, *total),
            event => {
                if let Some(text) = sentence(event) {
                    self.orders.tell(Training::Event { text });
                }
            }
        }
    }

    fn tell_progress(&mut self, task: &str, done: u64, total: u64) {
        if self.last_line.elapsed() < LINES {
            return;
        }
        self.last_line = Instant::now();
        let course = *locked(&self.wishes.course);
        self.tell_state(course, &format!("{task} {done}/{total}"));
    }

    fn tell_state(&self, course: Course, task: &str) {
        self.orders.tell_now(match course {
            Course::Wait if task.is_empty() => state(true, WAITS),
            Course::Wait => state(true, &format!("{task}; {WAITS}")),
            Course::GoOn | Course::End => state(false, task),
        });
    }

    /// Somebody wishes that the training is saved and ends.
    pub fn is_to_end(&self) -> bool {
        *locked(&self.wishes.course) == Course::End
    }

    /// If a wish to wait has stopped the training: waits until it shall go on, and says whether it shall; false if the program
    /// shall end, or if something else has stopped it. The painter has the whole machine meanwhile.
    pub fn wait(&mut self) -> bool {
        if !std::mem::take(&mut self.stopped_to_wait) {
            return false;
        }
        self.orders.set_share(1.0);
        self.orders.tell_now(state(true, "waits"));
        let mut course = locked(&self.wishes.course);
        while *course == Course::Wait && !interrupted() {
            let waited = self.wishes.changed.wait_timeout(course, LOOK);
            course = waited.unwrap_or_else(|e| e.into_inner()).0;
        }
        let goes_on = *course == Course::GoOn && !interrupted();
        drop(course);
        self.orders.set_share(SHARE);
        self.orders.tell_now(state(false, if goes_on { "continues" } else { "ends" }));
        goes_on
    }

    /// The training has ended and is saved: its last state is shown, and pages are told why.
    pub fn end(mut self, session: &Session, stop: Stop) {
        *locked(&self.wishes.ended) = true;
        self.orders.set_share(1.0);
        if !interrupted() {
            drop(self.orders.renew(session.snapshot())); // nobody waits for it
        }
        let (step, run) = (session.state().step, self.run.display());
        let why = match stop {
            Stop::Finished => format!(
                "The training has finished after {step} steps. `refraxel view {run}` shows it from now on."
            ),
            _ => format!(
                "The training was stopped at step {step} and is saved in {run}. The same command with --resume continues it; \
                 `refraxel view {run}` shows it."
            ),
        };
        self.say_goodbye(why, LAST_PICTURE);
    }

    fn say_goodbye(&mut self, why: String, most: Duration) {
        self.has_ended = true;
        let until = Instant::now() + most;
        let until_interrupted = Instant::now() + LAST_WORDS;
        self.orders.end(why, || Instant::now() < if interrupted() { until_interrupted } else { until });
    }
}

impl Drop for Viewing {
    fn drop(&mut self) {
        if !self.has_ended {
            *locked(&self.wishes.ended) = true;
            self.say_goodbye("The training has failed; the terminal says why.".to_owned(), LAST_WORDS);
        }
    }
}

/// What the training does now, for the page.
fn state(paused: bool, text: &str) -> Training {
    Training::State { paused, text: text.to_owned() }
}

/// A server for the page, where one is asked for; before any work is done.
pub fn bind(port: Option<u16>, run: &Path) -> Result<Option<Server>, Failure> {
    let server = port.map(Server::bind).transpose().or_exit(Exit::Io)?;
    Ok(server.map(|server| server.with_files([run.join(EVIDENCE)])))
}

/// Shows the run as it is, again and again while somebody looks.
fn renew(handle: &Handle, wishes: &Wishes, orders: &Orders) {
    let mut pause = RENEW;
    loop {
        thread::sleep(pause);
        if !orders.has_pages() {
            continue;
        }
        let Ok(run) = handle.snapshot().recv() else { return };
        let taken = {
            // The last state is not followed by an earlier one.
            let ended = locked(&wishes.ended);
            if *ended {
                return;
            }
            orders.renew(run)
        };
        pause = RENEW.max(taken.recv().unwrap_or_default().mul_f64(REST));
    }
}
