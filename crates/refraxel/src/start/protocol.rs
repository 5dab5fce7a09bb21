//! What the start page and the program say to each other, as JSON text.

use super::folders::{Folder, Place};
use super::runs::Recent;
use super::task::{Task, Work};
use serde::{Deserialize, Serialize};

/// What the page asks for.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(tag = "ask", rename_all = "snake_case", deny_unknown_fields)]
pub enum Ask {
    /// The runs that are there.
    Runs,
    /// What is in a folder.
    Folder {
        /// From the root.
        path: String,
    },
    /// A verb at work on a path.
    Begin(Task),
    /// The verb that is at work shall stop.
    Stop,
    /// What is shown of the last verb is not wanted any more.
    Forget,
    /// A run in the viewer.
    Open {
        /// Its folder.
        path: String,
    },
}

/// What the page is told.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(tag = "tell", rename_all = "snake_case")]
pub enum Tell {
    /// Where the program is at work, and the runs that it finds there.
    Home {
        /// The folder in which everything is written.
        folder: String,
        /// The latest first.
        runs: Vec<Recent>,
        /// Where to begin to look for photographs.
        places: Vec<Place>,
    },
    /// What is in a folder.
    Folder(Folder),
    /// The verb that is at work, or was last; null where there is none.
    Work {
        /// It.
        work: Option<Work>,
    },
    /// A run can be looked at.
    Opened {
        /// Its address.
        url: String,
    },
    /// Something cannot be done.
    Refused {
        /// Why, in full.
        why: String,
    },
    /// The program ends.
    Ended {
        /// Why, and what to do next.
        why: String,
    },
}
