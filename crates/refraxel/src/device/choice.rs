//! The choice between the CPU and a GPU.

use super::gpu::{Gpu, name};
use super::opened::{Decided, Needs, Opened};
use super::refusals::{only_train, unusable};
use crate::exit::Failure;
use refraxel_gpu::{AdapterKind, GpuBackend, GpuError, adapters};
use refraxel_train::device::{Device, DeviceChoice};

/// Whether a GPU can hold what a run is expected to become.
fn fits(gpu: &Gpu, needs: &Needs) -> Result<(), GpuError> {
    let bends = needs.options.refraction.bend.is_on();
    GpuBackend::fits(gpu, needs.degree(), needs.voxels as usize, bends)
}

/// The device that is asked for. `auto` is the CPU where a run needs what a GPU cannot do.
pub fn open(choice: DeviceChoice, needs: Option<Needs>) -> Result<Decided, Failure> {
    match choice {
        DeviceChoice::Cpu => return Ok(Decided::cpu(None)),
        DeviceChoice::Mpi => return Err(only_train()),
        DeviceChoice::Auto | DeviceChoice::Gpu | DeviceChoice::Adapter(_) => {}
    }
    let refused = needs.and_then(|n| GpuBackend::supports_run(n.options, n.saved, n.has_depth).err());
    match (choice, refused) {
        // Only who has a GPU wonders why it is not used.
        (DeviceChoice::Auto, Some(why)) => {
            let hardware = adapters().into_iter().find(|a| a.kind != AdapterKind::Software);
            Ok(Decided::cpu(hardware.map(|a| format!("{} is there, but {}", name(&a), why.what()))))
        }
        (_, Some(why)) => Err(unusable(why)),
        (_, None) => match Gpu::open(choice) {
            Ok(Some(gpu)) => {
                // An estimate: who names a GPU may know better, and what was learned until it fails is saved.
                let held = needs.map_or(Ok(()), |n| fits(&gpu, &n));
                if let (DeviceChoice::Auto, Err(why)) = (choice, held) {
                    return Ok(Decided::cpu(Some(why.to_string())));
                }
                let device = Device { name: name(gpu.adapter()), why: None };
                Ok(Decided { opened: Opened::Gpu(gpu), device })
            }
            Ok(None) => Ok(Decided::cpu(None)),
            // A GPU that nobody asked for by name must not be in the way.
            Err(error) if choice == DeviceChoice::Auto => Ok(Decided::cpu(Some(error.to_string()))),
            Err(error) => Err(unusable(error)),
        },
    }
}
