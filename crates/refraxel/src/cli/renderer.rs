//! Flags of the verbs that show a run.

use clap::Args;
use refraxel_train::device::DeviceChoice;

/// What renders a run; shared by the verbs that show one.
#[derive(Args, Clone, Copy, Debug)]
pub struct RendererArgs {
    /// The device to render on: auto, cpu, gpu, or gpu:N as inspect --devices lists them
    ///
    /// auto is the CPU unless the program was built for GPUs and there is one that can show the run. Where a GPU fails, the CPU
    /// continues.
    #[arg(long, value_name = "DEVICE", default_value = "auto")]
    pub device: DeviceChoice,
}
