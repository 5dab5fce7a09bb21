//! The search for what straight rays cannot explain.

use crate::cli::MaskArgs;
use crate::exit::{Exit, Failure, OrExit};
use crate::progress::Show;
use crate::verbs::interrupts::interrupted;
use crate::verbs::options::set_all;
use crate::verbs::train::{ProgressDisplay, session_failure};
use refraxel_data::{Dataset, scene_region};
use refraxel_train::detection::{Found, Hints};
use refraxel_train::events::{Event, Task};
use refraxel_train::model::Gate;
use refraxel_train::options::Switch;
use refraxel_train::session::Setup;
use refraxel_train::{Options, refraction_search};

/// Options of a detector that is sent alone.
pub(super) fn options(args: &MaskArgs, data: &Dataset) -> Result<Options, Failure> {
    let mut options = Options::suited_to(scene_region(data).extent(), false);
    set_all(&args.settings, &mut options)?;
    (options.refraction.bend, options.detection.enabled) = (Switch::On, Switch::On);
    options.checked().or_exit(Exit::Usage)
}

/// Looks for what straight rays cannot explain; what it is, and its separation.
pub(super) fn found(setup: &Setup, hints: &Hints, show: Show) -> Result<(Gate, f64), Failure> {
    let mut watch = ProgressDisplay::new(show);
    let mut is_loaded = false;
    let found = setup.detect(hints, &mut |event| match event {
        Event::Progress { task: Task::LoadingPhotos, .. } => watch.load(&event),
        _ => {
            if !std::mem::replace(&mut is_loaded, true) {
                watch.start(None);
            }
            watch.tell(&event);
        }
    });
    watch.end(found.is_ok());
    if interrupted() {
        return Err(Exit::Interrupted.because("stopped before anything was found; no mask was written"));
    }
    let Found { gate, separation } = found.map_err(session_failure)?;
    let nothing = || {
        let masks = setup.data.views.iter().filter(|v| v.has_mask()).count();
        let advice = if masks >= refraction_search::LEAST_MASKS {
            format!(
                "{masks} photographs have masks, which suffice for training: their visual hull completes the others"
            )
        } else {
            "point at the glass in some photographs with --click VIEW X Y, --box VIEW X0 Y0 X1 Y1 or --outline VIEW X,Y X,Y X,Y"
                .to_owned()
        };
        Exit::BadInput.because(format!("nothing was found that straight rays cannot explain; {advice}"))
    };
    let gate = gate.ok_or_else(nothing)?;
    Ok((gate, separation))
}
