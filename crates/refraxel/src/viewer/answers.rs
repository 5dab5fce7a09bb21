//! Who answers the pages of a scene: the painter, and for some questions others.

use super::control::{Control, Wish};
use super::films::Films;
use super::orders::{Order, Orders};
use super::outgoing::Outgoing;
use super::photograph_desk::PhotographDesk;
use super::protocol::{Ask, Tell};
use super::socket::{Answerer, Visitor};
use std::sync::Arc;

/// Who answers the pages of a scene.
pub(super) struct SceneAnswers {
    /// The painter.
    pub orders: Orders,
    /// Who reads photographs.
    pub photographs: Arc<PhotographDesk>,
    /// The training, where there is one.
    pub control: Option<Control>,
    /// Who renders films, where the run is there to render them from.
    pub films: Option<Films>,
}

impl Answerer for SceneAnswers {
    fn join(&self, page: &Visitor) -> bool {
        self.orders.give(Order::Join(page.id, page.out.clone(), Arc::clone(&page.mailbox)))
    }

    fn take(&self, page: &Visitor, text: &str) -> Option<Outgoing> {
        match serde_json::from_str(text) {
            Ok(ask) => self.pass_on(ask, page),
            Err(error) => Some(refused(format!("this question is not understood: {error}"))),
        }
    }

    fn leave(&self, page: &Visitor) {
        self.orders.give(Order::Leave(page.id));
    }
}

impl SceneAnswers {
    /// Gives a question to whom it concerns.
    fn pass_on(&self, ask: Ask, page: &Visitor) -> Option<Outgoing> {
        match (ask, &self.control, &self.films) {
            (Ask::Photo { view }, ..) => self.photographs.ask(page.id, view, &page.out),
            (Ask::Pause { .. } | Ask::Stop, None, _) => {
                return Some(refused("nothing is trained here".to_owned()));
            }
            (Ask::Pause { paused }, Some(control), _) => control(Wish::Pause(paused)),
            (Ask::Stop, Some(control), _) => control(Wish::Stop),
            (Ask::Film(wish), _, Some(films)) => {
                return films.begin(&wish, &page.out).err().map(refused);
            }
            (Ask::StopFilm, _, Some(films)) => films.stop(),
            (Ask::Film(_) | Ask::StopFilm, _, None) => {
                return Some(refused("films are rendered once the training has ended".to_owned()));
            }
            (ask, ..) => {
                if page.mailbox.put(ask) {
                    self.orders.give(Order::Look(page.id));
                }
            }
        }
        None
    }
}

fn refused(why: String) -> Outgoing {
    Outgoing::tell(&Tell::Refused { why })
}
