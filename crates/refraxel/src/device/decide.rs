//! The decision on which device a run goes.

#[cfg(feature = "gpu")]
use super::choice::open;
#[cfg(not(feature = "gpu"))]
use super::no_choice::open;
use super::opened::{Decided, Needs, Opened};
use super::process_group::ProcessGroup;
use crate::exit::Failure;
use crate::progress::Show;
use refraxel_train::device::{Device, DeviceChoice};
use std::process;

/// Opens the device of a run, before any other work, and says why it is the CPU where a GPU would do.
pub fn decide(
    choice: DeviceChoice,
    group: Option<&ProcessGroup>,
    needs: Needs,
    show: Show,
) -> Result<Decided, Failure> {
    if let Some(group) = group {
        let options = needs.saved.map_or(needs.options, |run| &run.options);
        let device = Device { name: format!("cpu of {} processes", group.count), why: None };
        let threads = rayon::current_num_threads();
        show.say(&format!(
            "note: on the {}; this one, the first, is {}, and has {threads} threads",
            device.name,
            process::id()
        ));
        return Ok(Decided {
            opened: Opened::ProcessGroup(group.clone(), Box::new(options.clone())),
            device,
        });
    }
    let decided = open(choice, Some(needs))?;
    decided.say(show);
    Ok(decided)
}
