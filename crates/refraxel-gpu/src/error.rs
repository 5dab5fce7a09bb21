//! What can go wrong with a GPU.

/// Why a GPU cannot be used, or no longer.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum GpuError {
    /// There is no adapter, or none that was asked for.
    #[error("no usable GPU: {found}; install a Vulkan driver, or use `--device cpu`")]
    NoAdapter {
        /// What was found.
        found: String,
    },
    /// An adapter cannot do what the kernels need.
    #[error(
        "{adapter} cannot be used: {limit} is {found}, and at least {needed} is needed; use `--device cpu`"
    )]
    Unsuitable {
        /// Its name.
        adapter: String,
        /// What falls short.
        limit: &'static str,
        /// What the adapter has.
        found: u64,
        /// What the kernels need.
        needed: u64,
    },
    /// An adapter did not give a device.
    #[error("{adapter} could not be opened: {reason}; use another adapter or `--device cpu`")]
    Open {
        /// Its name.
        adapter: String,
        /// What the driver said.
        reason: String,
    },
    /// Something is larger than the adapter can bind.
    #[error(
        "{what} needs {needed} byte, and {adapter} binds at most {most}; lower `grid.resolution` or `run.batch`, or use \
         `--device cpu`"
    )]
    TooLarge {
        /// What is too large.
        what: String,
        /// Name of the adapter.
        adapter: String,
        /// Its size.
        needed: u64,
        /// What can be bound.
        most: u64,
    },
    /// The memory of the device is exhausted.
    #[error(
        "the memory of {adapter} is exhausted ({bytes} byte for {what}); lower `grid.resolution` or `field.sh_degree`, or use `--device cpu`"
    )]
    OutOfMemory {
        /// What did not fit.
        what: String,
        /// Its size.
        bytes: u64,
        /// Name of the adapter.
        adapter: String,
    },
    /// The device has less memory than a model needs.
    #[error(
        "the model needs {needed} byte, and {adapter} has {found}; lower `grid.resolution` or `field.sh_degree`, or use \
         `--device cpu`"
    )]
    LittleMemory {
        /// Name of the adapter.
        adapter: String,
        /// What the model and all that it learns by take.
        needed: u64,
        /// The memory of the adapter.
        found: u64,
    },
    /// The device is gone: a driver that was reset, a watchdog, a cable.
    #[error(
        "{adapter} was lost: {reason}; continue the saved run by `--resume`, with `--device cpu` if it happens again"
    )]
    Lost {
        /// Name of the adapter.
        adapter: String,
        /// What the driver said.
        reason: String,
    },
    /// The device does not answer: a kernel that does not end, or a driver that waits for something.
    #[error("{adapter} has not answered for {seconds} s; continue the saved run by `--resume --device cpu`")]
    Stalled {
        /// Name of the adapter.
        adapter: String,
        /// How long the host has waited.
        seconds: u64,
    },
    /// The driver refused something that it should not refuse.
    #[error("{adapter} reported an error: {reason}; use `--device cpu`")]
    Driver {
        /// Name of the adapter.
        adapter: String,
        /// What it said.
        reason: String,
    },
    /// A ray would take more steps than a software adapter counts.
    #[error(
        "{adapter} stops loops after {most} iterations, and a ray may need {needed}; lower `grid.resolution`, or use `--device cpu`"
    )]
    TooManySteps {
        /// Name of the adapter.
        adapter: String,
        /// Iterations of the longest ray.
        needed: u64,
        /// What the adapter allows.
        most: u64,
    },
    /// A few segments of a path took more steps than a software adapter counts.
    #[error(
        "{adapter} stops loops after {most} iterations, and a part of the path of a ray took more; lower `grid.resolution`, or use `--device cpu`"
    )]
    CutShort {
        /// Name of the adapter.
        adapter: String,
        /// What the adapter allows.
        most: u64,
    },
    /// The model has something that the backend does not have yet.
    #[error(transparent)]
    Unsupported(#[from] Unsupported),
}

impl GpuError {
    /// The error that a kernel needs more arrays than an adapter of this name binds.
    pub(crate) fn few_bindings(adapter: &str, found: u32, needed: u32) -> Self {
        let limit = "the number of storage buffers of a kernel";
        Self::Unsuitable { adapter: adapter.to_owned(), limit, found: found.into(), needed: needed.into() }
    }
}

/// What the GPU backend does not have yet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}; use `--device cpu`, or {}", self.what(), self.without())]
#[non_exhaustive]
pub enum Unsupported {
    /// Steps through the index by another rule than leapfrog.
    Integrator,
    /// Depth maps beside photographs.
    Depth,
}

impl Unsupported {
    /// What is not there.
    pub fn what(self) -> &'static str {
        match self {
            Self::Integrator => "the GPU backend traces rays by leapfrog only",
            Self::Depth => {
                "the GPU backend does not learn from depth maps (--set field.depth=0 leaves them out)"
            }
        }
    }

    /// How to do without.
    fn without(self) -> &'static str {
        match self {
            Self::Integrator => "that rule",
            Self::Depth => "them",
        }
    }
}
