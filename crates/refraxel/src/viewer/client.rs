//! A page as the painter sees it: what it wishes, and how far its picture is.

use super::error::SceneError;
use super::outgoing::{Out, Outgoing};
use super::photographs::encode;
use super::picture::{Painted, Picture};
use super::protocol::{Ask, Header, Look, Tell, message};
use super::questions::{Mailbox, Questions};
use super::scene::Scene;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Pictures on the way to a page; a page behind a slow link gets the next one when it has received an earlier one. Three of 15 kB
/// fill a link of 1 MB/s with 100 ms there and back.
const ON_THE_WAY: u64 = 3;
/// Qualities of JPEG files, 1 to 100: of pictures on the way to a better one, and of the best.
const QUALITY: [u8; 2] = [75, 92];
/// How fast rays are before any was measured [1 / s].
const FIRST_SPEED: f64 = 150_000.0;
/// Share of a new measurement in the speed.
const NEW: f64 = 0.3;

/// A page.
pub struct Client {
    out: Out,
    look: Option<Look>,
    /// A look that waits for the first pass of the one before.
    next: Option<Look>,
    picture: Option<Picture>,
    /// The picture was begun before the state of the training that is shown next; that one waits for it.
    is_awaited: bool,
    /// The page shows a whole picture of the look that waits: coarse ones would be worse.
    is_shown: bool,
    /// Rays per second of the passes of late.
    speed: f64,
    /// Rays of the pass that is painted, and how long they took so far.
    pass: (usize, Duration),
    since: Instant,
    sent: u64,
    received: u64,
    /// When it was painted last.
    served: u64,
    mailbox: Arc<Mailbox>,
    /// What it asks for beside pictures.
    questions: Questions,
}

impl Client {
    /// A page that gets its messages here, and puts its questions there.
    pub fn new(out: Out, mailbox: Arc<Mailbox>) -> Self {
        Self {
            out,
            look: None,
            next: None,
            picture: None,
            is_awaited: false,
            is_shown: false,
            speed: FIRST_SPEED,
            pass: (0, Duration::ZERO),
            since: Instant::now(),
            sent: 0,
            received: 0,
            served: 0,
            mailbox,
            questions: Questions::default(),
        }
    }

    /// The way to the page.
    pub fn out(&self) -> Out {
        self.out.clone()
    }

    /// Tells the page something. Nobody may be there any more.
    pub fn tell(&self, tell: &Tell) {
        self.out.send(Outgoing::tell(tell));
    }

    /// Sends the page a picture.
    pub fn send(&self, header: &Header, jpeg: &[u8]) {
        self.out.send(Outgoing::Picture(message(header, jpeg)));
    }

    /// Tells the page why something cannot be done.
    pub fn refuse(&self, why: &SceneError) {
        self.tell(&Tell::Refused { why: why.to_string() });
    }

    /// Takes what the page asks for out of its mailbox.
    pub fn empty_mailbox(&mut self) {
        for ask in self.mailbox.empty() {
            match ask {
                Ask::Look(look) => self.look_at(look),
                Ask::Got { frame } => self.has_received(frame),
                ask => self.questions.put(ask),
            }
        }
    }

    /// The question that waits longest; it takes as long as a piece of a picture.
    pub fn question(&mut self, now: u64) -> Option<Ask> {
        let question = self.questions.take_first()?;
        self.served = now;
        Some(question)
    }

    /// What is looked at.
    pub fn look(&self) -> Option<&Look> {
        self.next.as_ref().or(self.look.as_ref())
    }

    /// The page looks elsewhere. The coarse picture of a moving camera is finished before, else it would never be seen.
    fn look_at(&mut self, look: Look) {
        self.next = Some(look);
        (self.is_awaited, self.is_shown) = (false, false);
    }

    /// The page has received its pictures up to this one.
    fn has_received(&mut self, frame: u64) {
        self.received = self.received.max(frame.min(self.sent));
    }

    /// Another state of the scene arrives: it waits for the picture that is being painted. A training that goes on would never
    /// let a picture be whole otherwise.
    pub fn is_overtaken(&mut self) {
        self.is_awaited = true;
    }

    /// Whether another state of the scene has to wait for the picture. It does not wait for more than one ray per pixel, nor for a
    /// page that does not take what is painted.
    pub fn holds_scene(&self) -> bool {
        let is_begun = self.picture.as_ref().is_some_and(|picture| !picture.is_whole());
        self.is_awaited && is_begun && self.urgency().is_some()
    }

    /// The scene is another, and the picture is painted anew: no picture mixes two states.
    pub fn start_again(&mut self) {
        let picture = self.picture.take();
        self.is_awaited = false;
        if self.next.is_none() {
            let rests = self.look.as_ref().is_some_and(|look| !look.moving);
            self.is_shown = rests && (self.is_shown || picture.is_some_and(|picture| picture.is_whole()));
            self.next.clone_from(&self.look);
        }
    }

    /// When it was painted last.
    pub fn served(&self) -> u64 {
        self.served
    }

    /// The order in which pages are painted, the smallest first; `None` where nothing is to be done.
    pub fn urgency(&self) -> Option<(usize, u64)> {
        if !self.questions.is_empty() {
            return Some((0, self.served));
        }
        let passes = match (&self.next, &self.picture) {
            (Some(_), Some(picture)) if !picture.must_finish() => 0,
            (Some(_), None) => 0,
            (_, Some(picture)) if !picture.is_finished() => picture.passes(),
            (Some(_), _) => 0,
            _ => return None,
        };
        (self.sent - self.received < ON_THE_WAY).then_some((passes, self.served))
    }

    /// Paints a portion of the page's picture.
    pub fn paint(&mut self, scene: &mut Scene, portion: usize, first_pass: Duration, now: u64) {
        self.served = now;
        let keeps = self.picture.as_ref().is_some_and(|p| p.must_finish() && !p.is_finished());
        if let Some(look) = self.next.take_if(|_| !keeps)
            && let Err(why) = self.begin(scene, look, first_pass)
        {
            self.picture = None;
            return self.refuse(&why);
        }
        let (Some(look), Some(picture)) = (&self.look, &mut self.picture) else { return };
        if let Err(why) = scene.wear(look) {
            self.picture = None;
            return self.refuse(&why);
        }
        let start = Instant::now();
        let before = picture.passes();
        let (rays, painted) = picture.advance(scene, portion);
        self.pass.0 += rays;
        self.pass.1 += start.elapsed();
        if picture.passes() > before {
            // Whole passes alone: the top of a picture may be empty, and its middle full of glass.
            let (rays, time) = std::mem::take(&mut self.pass);
            self.speed += NEW * (rays as f64 / time.as_secs_f64().max(1e-6) - self.speed);
        }
        if let Some(painted) = painted {
            self.show(&painted, scene.step());
        }
    }

    fn begin(&mut self, scene: &mut Scene, look: Look, first_pass: Duration) -> Result<(), SceneError> {
        let camera = scene.camera(&look)?;
        let rays = if self.is_shown { f64::INFINITY } else { self.speed * first_pass.as_secs_f64() };
        self.picture = Some(Picture::new(look.shown, camera, look.moving, rays));
        (self.look, self.since, self.pass) = (Some(look), Instant::now(), (0, Duration::ZERO));
        Ok(())
    }

    fn show(&mut self, painted: &Painted, step: u64) {
        let Some(look) = &self.look else { return };
        self.sent += 1;
        let header = Header::Frame {
            id: look.id,
            frame: self.sent,
            size: painted.size,
            rays: painted.rays,
            last: painted.last,
            ms: 1e3 * self.since.elapsed().as_secs_f64(),
            range: painted.range,
            step,
        };
        let is_best = painted.last && !look.moving;
        self.send(&header, &encode(&painted.pixels, painted.size, QUALITY[usize::from(is_best)]));
    }
}
