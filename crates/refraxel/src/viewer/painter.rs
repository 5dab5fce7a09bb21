//! The thread that paints for all pages: the coarsest picture first, a portion of rays at a time.

use super::bend;
use super::bricks::bricks;
use super::client::Client;
use super::contours::{contours, hulls};
use super::error::SceneError;
use super::history::History;
use super::orders::{FAILED, Order, Orders};
use super::outgoing::{Out, Outgoing};
use super::picture::PORTION;
use super::protocol::{Ask, Look, Tell, Training};
use super::scene::Scene;
use super::slice::slice;
use rayon::ThreadPoolBuilder;
use refraxel_core::{Ray, Vec3};
use refraxel_train::run::Run;
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread;
use std::time::{Duration, Instant};

/// Time of the first, coarse pass of a picture: 15 frames per second with what else a frame takes.
const FIRST_PASS: Duration = Duration::from_millis(55);

/// Orders that are obeyed between two portions, at most.
const ORDERS: usize = 64;
/// One of so many portions goes to the page that waits longest; the others to questions and coarse pictures first.
const FAIR: u64 = 4;

/// Paints for all pages.
pub struct Painter {
    scene: Scene,
    orders: Receiver<Order>,
    clients: BTreeMap<u64, Client>,
    /// How many they are, for other threads.
    pages: Arc<AtomicUsize>,
    /// Share of the time that it may work.
    share: f64,
    /// The next state of the training, shown once no picture of the present one has to be finished; whoever sent it learns how
    /// long that took.
    renewal: Option<(Box<Run>, Sender<Duration>)>,
    /// Who waits until there is nothing to paint.
    idle: Vec<Sender<Vec<Out>>>,
    /// What pages have asked for to draw over pictures.
    drawings: BTreeMap<Drawing, Outgoing>,
    /// Portions painted.
    painted: u64,
    /// What was told of the training, for pages that open later.
    history: History,
    /// The last that was told of what it does now.
    latest: Option<Training>,
    /// Why the program ends soon.
    ended: Option<String>,
}

impl Painter {
    /// A painter of a scene; `share` of the time in (0, 1] it may work, and rests for the remainder.
    pub fn new(scene: Scene, share: f64) -> (Self, Orders) {
        let (sender, orders) = channel();
        let pages = Arc::new(AtomicUsize::new(0));
        let painter = Self {
            scene,
            orders,
            clients: BTreeMap::new(),
            pages: Arc::clone(&pages),
            share,
            renewal: None,
            idle: Vec::new(),
            drawings: BTreeMap::new(),
            painted: 0,
            history: History::default(),
            latest: None,
            ended: None,
        };
        (painter, Orders::new(sender, pages))
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Works until nobody can give orders any more: obeys those that are there, paints a portion, rests.
    ///
    /// Beside a training it has threads of its own: those of all work look at a job that comes from elsewhere when they have none
    /// left, and may begin a long one of the training while they wait for a part of a picture.
    pub fn work(self) {
        let threads = || ThreadPoolBuilder::new().num_threads(rayon::current_num_threads()).build().ok();
        match Some(self.share).filter(|share| *share < 1.0).and_then(|_| threads()) {
            Some(own) => own.install(|| self.take_orders()),
            None => self.take_orders(),
        }
    }

    fn take_orders(mut self) {
        let mut rests_until = Instant::now();
        loop {
            match self.next_order(rests_until) {
                Err(RecvTimeoutError::Disconnected) => return,
                Ok(order) => self.obey(order),
                Err(RecvTimeoutError::Timeout) => {}
            }
            let orders: Vec<Order> = self.orders.try_iter().take(ORDERS).collect();
            orders.into_iter().for_each(|order| self.obey(order));
            let start = Instant::now();
            if start >= rests_until {
                self.paint();
                let end = Instant::now();
                rests_until = end + (end - start).mul_f64(1.0 / self.share - 1.0);
            }
            self.renew();
            self.tell_idle();
        }
    }

    /// Takes the next state of the training over, unless a picture of the present one is to be finished before.
    fn renew(&mut self) {
        if self.clients.values().any(Client::holds_scene) {
            return;
        }
        let Some((run, taken)) = self.renewal.take() else { return };
        let start = Instant::now();
        self.scene.renew(*run);
        self.drawings.clear();
        let _ = taken.send(start.elapsed()); // nobody may want to know
        let scene = Tell::Scene(Box::new(self.scene.describe()));
        for client in self.clients.values_mut() {
            client.tell(&scene);
            client.start_again();
        }
    }

    /// Tells who waits for it that all pages have been sent what there is to see.
    fn tell_idle(&mut self) {
        if self.clients.values().all(|c| c.urgency().is_none()) {
            let ways = || self.clients.values().map(Client::out).collect();
            self.idle.drain(..).for_each(|waiting| drop(waiting.send(ways())));
        }
    }

    /// The next order. Waits for it until the rest is over if there is something to paint, and without end if there is not.
    fn next_order(&self, rests_until: Instant) -> Result<Order, RecvTimeoutError> {
        if self.clients.values().any(|c| c.urgency().is_some()) {
            return self.orders.recv_timeout(rests_until.saturating_duration_since(Instant::now()));
        }
        self.orders.recv().map_err(|_| RecvTimeoutError::Disconnected)
    }

    fn paint(&mut self) {
        let is_fair = self.painted.is_multiple_of(FAIR);
        let order = |(_, client): &(&u64, &mut Client)| {
            if is_fair { Some((0, client.served())) } else { client.urgency() }
        };
        let waiting = self.clients.iter_mut().filter(|(_, client)| client.urgency().is_some());
        let Some((&id, client)) = waiting.min_by_key(order) else { return };
        self.painted += 1;
        if let Some(ask) = client.question(self.painted) {
            return self.answer(id, ask);
        }
        let portion = (PORTION as f64 * self.share) as usize;
        client.paint(&mut self.scene, portion, FIRST_PASS.mul_f64(self.share.sqrt()), self.painted);
    }

    fn obey(&mut self, order: Order) {
        self.follow(order);
        self.pages.store(self.clients.len(), Ordering::SeqCst);
    }

    fn follow(&mut self, order: Order) {
        match order {
            Order::Join(id, out, mailbox) => {
                let client = Client::new(out, mailbox);
                client.tell(&Tell::Scene(Box::new(self.scene.describe())));
                self.history
                    .told()
                    .chain(&self.latest)
                    .for_each(|what| client.tell(&Tell::Training(what.clone())));
                self.ended.iter().for_each(|why| client.tell(&Tell::Ended { why: why.clone() }));
                self.clients.insert(id, client);
            }
            Order::Leave(id) => drop(self.clients.remove(&id)),
            Order::Look(id) => {
                if let Some(client) = self.clients.get_mut(&id) {
                    client.empty_mailbox();
                }
            }
            Order::Share(share) => self.share = share,
            Order::End(why) => {
                self.clients.values().for_each(|client| client.tell(&Tell::Ended { why: why.clone() }));
                self.ended = Some(why);
            }
            Order::Renew(run, taken) => {
                // Where one waits already, this one takes its place and does not wait for longer.
                if self.renewal.replace((run, taken)).is_none() {
                    self.clients.values_mut().for_each(Client::is_overtaken);
                }
            }
            Order::Idle(waiting) => self.idle.push(waiting),
            Order::Tell { what, is_kept } => {
                self.clients.values().for_each(|client| client.tell(&Tell::Training(what.clone())));
                if is_kept {
                    self.history.keep(what);
                } else {
                    self.latest = Some(what);
                }
            }
        }
    }

    /// Sends a page something to draw, which is made once for all of them.
    fn draw(&mut self, id: u64, drawing: Drawing) {
        let Some(client) = self.clients.get(&id) else { return };
        let known = match self.drawings.entry(drawing) {
            Entry::Occupied(known) => Ok(known.into_mut()),
            Entry::Vacant(place) => drawing.of(&self.scene).map(|drawn| place.insert(Outgoing::tell(&drawn))),
        };
        match known {
            Ok(drawn) => client.out().send(drawn.clone()),
            Err(why) => client.refuse(&why),
        }
    }

    fn answer(&mut self, id: u64, ask: Ask) {
        let Some(client) = self.clients.get_mut(&id) else { return };
        match ask {
            Ask::Ray { id, u, v } => {
                let ray = client.look().cloned().map(|look| ray_through(&mut self.scene, &look, [u, v]));
                tell_ray(&self.scene, client, id, ray);
            }
            Ask::Follow { id, origin, direction } => {
                let look = client.look().cloned();
                let local = self.scene.origin().to_local(Vec3::from(origin));
                let ray = look.map(|look| self.scene.wear(&look).and_then(|()| ray_of(local, direction)));
                tell_ray(&self.scene, client, id, ray);
            }
            Ask::Slice { region, axis, at } => {
                let worn = client.look().cloned().map_or(Ok(()), |look| self.scene.wear(&look));
                match worn.and_then(|()| slice(&self.scene, region, axis, at)) {
                    Ok((header, jpeg)) => client.send(&header, &jpeg),
                    Err(why) => client.refuse(&why),
                }
            }
            Ask::Surface { region } => self.draw(id, Drawing::Surface(region)),
            Ask::Hull => self.draw(id, Drawing::Hull),
            Ask::Bricks => self.draw(id, Drawing::Bricks),
            // Others answer these, or nobody has to.
            Ask::Look(_)
            | Ask::Got { .. }
            | Ask::Photo { .. }
            | Ask::Pause { .. }
            | Ask::Stop
            | Ask::Film(_)
            | Ask::StopFilm => {}
        }
    }
}

/// What is drawn over pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Drawing {
    /// The surface of a region.
    Surface(usize),
    Hull,
    Bricks,
}

impl Drawing {
    fn of(self, scene: &Scene) -> Result<Tell, SceneError> {
        match self {
            Self::Surface(region) => contours(scene, region).map(|pieces| Tell::Surface { region, pieces }),
            Self::Hull => Ok(Tell::Hull { parts: hulls(scene) }),
            Self::Bricks => Ok(bricks(scene)),
        }
    }
}

impl Drop for Painter {
    fn drop(&mut self) {
        if thread::panicking() {
            self.clients.values().for_each(|client| client.out().end(FAILED));
            let opened = self.orders.try_iter().filter_map(|order| match order {
                Order::Join(_, out, _) => Some(out),
                _ => None,
            });
            opened.for_each(|out| out.end(FAILED));
        }
    }
}

/// Tells a page of a ray, or why there is none. A page that has not looked yet is told nothing.
fn tell_ray(scene: &Scene, client: &Client, id: u64, ray: Option<Result<Ray<f32>, SceneError>>) {
    match ray {
        Some(Ok(ray)) => client.tell(&Tell::Ray { id, ray: bend::follow(scene, &ray) }),
        Some(Err(why)) => client.refuse(&why),
        None => {}
    }
}

/// The ray through a place of a picture, in the medium of its look.
fn ray_through(scene: &mut Scene, look: &Look, [u, v]: [f64; 2]) -> Result<Ray<f32>, SceneError> {
    let camera = scene.camera(look)?;
    scene.wear(look)?;
    let inside = [u, v].iter().all(|x| (0.0..=1.0).contains(x));
    let ray = camera.ray(u * f64::from(camera.width), v * f64::from(camera.height)).filter(|_| inside);
    ray.map(|r| r.cast()).ok_or_else(|| SceneError::Look("no ray passes there".to_owned()))
}

fn ray_of(origin: Vec3<f64>, direction: [f64; 3]) -> Result<Ray<f32>, SceneError> {
    let direction = Vec3::from(direction);
    let is_ray = origin.length() < 1e9 && (1e-9..1e9).contains(&direction.length());
    if !is_ray {
        return Err(SceneError::Look(
            "ray: expected finite numbers and a direction other than zero".to_owned(),
        ));
    }
    Ok(Ray { origin, direction: direction.normalized() }.cast())
}
