//! The live page of a training: what it is told, and what it may ask.

use super::evidence::EVIDENCE;
use crate::exit::{Exit, Failure, OrExit};
use crate::progress::Show;
use crate::sentences::{phase_name, sentence, task_name};
use crate::verbs::interrupts::interrupted;
use crate::viewer::{Orders, Painter, Scene, Server, Wish};
use refraxel_train::events::Event;
use refraxel_train::session::{Handle, Session};
use serde_json::{Value, json};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
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
/// How often a training that waits looks whether the program shall end.
const LOOK: Duration = Duration::from_millis(100);

/// The page of a training.
pub struct Viewing {
    orders: Orders,
    handle: Handle,
    wishes: Arc<Wishes>,
    /// The training was stopped so that it waits.
    stopped_to_wait: bool,
    last_line: Instant,
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
    /// The training has ended: no copies of it are made any more.
    ended: AtomicBool,
}

impl Wishes {
    fn course(&self) -> MutexGuard<'_, Course> {
        self.course.lock().unwrap_or_else(|e| e.into_inner())
    }

    /// Takes a wish, unless the training shall end already.
    fn set(&self, wished: Course) {
        let mut course = self.course();
        if *course != Course::End {
            *course = wished;
        }
        self.changed.notify_all();
    }
}

impl Viewing {
    /// Opens the page on a server that listens already, and says where.
    pub fn start(server: Server, name: String, session: &Session, show: Show) -> Self {
        let (handle, wishes) = (session.handle(), Arc::new(Wishes::default()));
        let scene = Scene::new(name, session.snapshot(), Some(session.data()));
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
                asked.set(if paused { Course::Wait } else { Course::GoOn });
                let text = if paused { "waits at the next record" } else { "goes on" };
                told.tell_now(state(paused, text));
            }
        };
        server.start(orders.clone(), photographs, Some(Arc::new(control)));
        thread::spawn(|| painter.work());
        let (copies, until, shown) = (handle.clone(), Arc::clone(&wishes), orders.clone());
        thread::spawn(move || renew(&copies, &until, &shown));
        Self { orders, handle, wishes, stopped_to_wait: false, last_line: Instant::now() }
    }

    /// Tells the page what happens. A wish to wait is fulfilled between two steps, so that no long phase is lost.
    pub fn tell(&mut self, event: &Event) {
        match event {
            Event::Record(record) => {
                let mut told = serde_json::to_value(record).unwrap_or_default(); // numbers: cannot fail
                if let Some(told) = told.as_object_mut() {
                    told.remove("events");
                    told.insert("kind".into(), "record".into());
                    told.insert("phase".into(), phase_name(record.phase).into());
                }
                self.orders.tell(told);
                let course = *self.wishes.course();
                if course != Course::GoOn {
                    self.stopped_to_wait = course == Course::Wait;
                    self.handle.cancel();
                }
            }
            Event::Progress { task, done, total } => self.tell_progress(task_name(*task), *done, *total),
            event => {
                if let Some(text) = sentence(event) {
                    self.orders.tell(json!({ "kind": "event", "text": text }));
                }
            }
        }
    }

    fn tell_progress(&mut self, task: &str, done: u64, total: u64) {
        if self.last_line.elapsed() < LINES {
            return;
        }
        self.last_line = Instant::now();
        let waits = *self.wishes.course() == Course::Wait;
        let then = if waits { "; waits at the next record" } else { "" };
        self.orders.tell_now(state(waits, &format!("{task} {done}/{total}{then}")));
    }

    /// Somebody wishes that the training is saved and ends.
    pub fn is_to_end(&self) -> bool {
        *self.wishes.course() == Course::End
    }

    /// If a wish to wait has stopped the training: waits until it shall go on, and says whether it shall; false if the program
    /// shall end, or if something else has stopped it. The painter has the whole machine meanwhile.
    pub fn wait(&mut self) -> bool {
        if !std::mem::take(&mut self.stopped_to_wait) {
            return false;
        }
        self.orders.set_share(1.0);
        self.orders.tell_now(state(true, "waits"));
        let mut course = self.wishes.course();
        while *course == Course::Wait && !interrupted() {
            let waited = self.wishes.changed.wait_timeout(course, LOOK);
            course = waited.unwrap_or_else(|e| e.into_inner()).0;
        }
        let goes_on = *course == Course::GoOn && !interrupted();
        drop(course);
        self.orders.set_share(SHARE);
        self.orders.tell_now(state(false, if goes_on { "goes on" } else { "ends" }));
        goes_on
    }

    /// The training has ended: its last state is shown until the program ends.
    pub fn end(self, session: &Session) {
        self.wishes.ended.store(true, Ordering::SeqCst);
        if self.orders.has_pages() && !interrupted() {
            drop(self.orders.renew(session.snapshot())); // nobody waits for it
        }
        self.orders.set_share(1.0);
        let end: Value = json!({ "kind": "event", "text": "training has ended; `refraxel view` shows the run from now on" });
        self.orders.tell(end);
    }
}

/// What the training does now, for the page.
fn state(paused: bool, text: &str) -> Value {
    json!({ "kind": "state", "paused": paused, "text": text })
}

/// A server for the page, where one is asked for; before any work is done.
pub fn bind(port: Option<u16>, run: &Path) -> Result<Option<Server>, Failure> {
    let server = port.map(Server::bind).transpose().or_exit(Exit::Io)?;
    Ok(server.map(|server| server.with_evidence(run.join(EVIDENCE))))
}

/// Shows the run as it is, again and again while somebody looks.
fn renew(handle: &Handle, wishes: &Wishes, orders: &Orders) {
    let mut pause = RENEW;
    while !wishes.ended.load(Ordering::SeqCst) {
        thread::sleep(pause);
        if !orders.has_pages() {
            continue;
        }
        let Ok(run) = handle.snapshot().recv() else { return };
        if wishes.ended.load(Ordering::SeqCst) {
            return;
        }
        let taken = orders.renew(run).recv().unwrap_or_default();
        pause = RENEW.max(taken.mul_f64(REST));
    }
}
