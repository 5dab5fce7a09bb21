//! Whether two runs are the same.

use refraxel_train::session::Session;

/// The bits of a run, but for its clock.
pub fn bytes(session: &Session) -> Vec<u8> {
    let mut run = session.snapshot();
    run.state.seconds = 0.0;
    let mut bytes = Vec::new();
    run.view().write(&mut bytes).unwrap();
    bytes
}
