//! The live page of a training: what it is told, and what it may ask.

use crate::exit::{Exit, Failure, OrExit};
use crate::progress::Show;
use crate::sentences::{phase_name, sentence, task_name};
use crate::verbs::interrupts::interrupted;
use crate::viewer::{Orders, Painter, Scene, Server, Wish};
use refraxel_train::backend::Backend;
use refraxel_train::events::Event;
use refraxel_train::session::{Handle, Session};
use serde_json::{Value, json};
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
    last_line: Instant,
}

/// What pages wish.
#[derive(Default)]
struct Wishes {
    paused: Mutex<bool>,
    changed: Condvar,
    /// The training has ended: no copies of it are made any more.
    ended: AtomicBool,
}

impl Wishes {
    fn paused(&self) -> MutexGuard<'_, bool> {
        self.paused.lock().unwrap_or_else(|e| e.into_inner())
    }
}

impl Viewing {
    /// Opens the page on a server that listens already, and says where.
    pub fn start<B: Backend>(server: Server, name: String, session: &Session<B>, show: Show) -> Self {
        let (handle, wishes) = (session.handle(), Arc::new(Wishes::default()));
        let scene = Scene::new(name, session.snapshot(), Some(session.data()));
        let photographs = Arc::clone(scene.photographs());
        let (painter, orders) = Painter::new(scene, SHARE);
        show.say(&format!("live view: {}", server.url()));
        let (asked, by, told) = (Arc::clone(&wishes), handle.clone(), orders.clone());
        let control = move |wish| match wish {
            Wish::Stop => by.cancel(),
            Wish::Pause(paused) => {
                *asked.paused() = paused;
                asked.changed.notify_all();
                let text = if paused { "waits at the next record" } else { "goes on" };
                told.tell_now(state(paused, text));
            }
        };
        server.start(orders.clone(), photographs, Some(Arc::new(control)));
        thread::spawn(|| painter.work());
        let (copies, until, shown) = (handle.clone(), Arc::clone(&wishes), orders.clone());
        thread::spawn(move || renew(&copies, &until, &shown));
        Self { orders, handle, wishes, last_line: Instant::now() }
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
                if *self.wishes.paused() {
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
        self.orders.tell_now(state(self.is_paused(), &format!("{task} {done}/{total}")));
    }

    /// Somebody wishes that the training waits.
    pub fn is_paused(&self) -> bool {
        *self.wishes.paused()
    }

    /// Waits until the training shall go on; false if the program shall end. The painter has the whole machine meanwhile.
    pub fn wait(&self) -> bool {
        self.orders.set_share(1.0);
        self.orders.tell_now(state(true, "waits"));
        let mut paused = self.wishes.paused();
        while *paused && !interrupted() {
            let waited = self.wishes.changed.wait_timeout(paused, LOOK);
            paused = waited.unwrap_or_else(|e| e.into_inner()).0;
        }
        drop(paused);
        self.orders.set_share(SHARE);
        self.orders.tell_now(state(false, "goes on"));
        !interrupted()
    }

    /// The training has ended: its last state is shown until the program ends.
    pub fn end<B: Backend>(self, session: &Session<B>) {
        self.wishes.ended.store(true, Ordering::SeqCst);
        self.orders.renew(session.snapshot());
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
pub fn bind(port: Option<u16>) -> Result<Option<Server>, Failure> {
    port.map(Server::bind).transpose().or_exit(Exit::Io)
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
        pause = RENEW.max(orders.renew(run).mul_f64(REST));
    }
}
