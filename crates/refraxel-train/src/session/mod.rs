//! A run that a library user holds: open data, configure, train, watch, stop, look, save, go on.
//!
//! ```no_run
//! use refraxel_train::session::{Session, Setup, Until};
//! use refraxel_train::{CpuBackend, Options};
//! # fn train(data: refraxel_data::Dataset) -> Result<(), Box<dyn std::error::Error>> {
//! let setup = Setup::new(data, Options::default());
//! let mut session = Session::start(setup, CpuBackend::new, &mut |_| {})?;
//! session.run(Until::finished(), &mut |event| println!("{event:?}"))?;
//! # Ok(()) }
//! ```

mod error;
mod evaluate;
mod handle;
mod make;
mod save;
mod setup;
mod start;
mod train;
mod until;

pub use error::SessionError;
pub use handle::Handle;
pub use make::{BackendError, IntoBackend};
pub use setup::Setup;
pub use start::Session;
pub use until::{Stop, Until};
