//! The device of a run: what is asked for, and what was taken.

use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// The device that somebody asks for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DeviceChoice {
    /// A hardware GPU where there is one that can do the work, else the CPU.
    #[default]
    Auto,
    /// The CPU.
    Cpu,
    /// The best hardware GPU.
    Gpu,
    /// The adapter of this number, which may be a software one.
    Adapter(usize),
    /// The CPUs of the processes that MPI has started together.
    Mpi,
}

/// As it is read.
impl fmt::Display for DeviceChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Auto => f.write_str("auto"),
            Self::Cpu => f.write_str("cpu"),
            Self::Gpu => f.write_str("gpu"),
            Self::Adapter(number) => write!(f, "gpu:{number}"),
            Self::Mpi => f.write_str("mpi"),
        }
    }
}

/// The name of a device was not understood.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{found}` is no device; expected auto, cpu, gpu, gpu:N with the number of an adapter, or mpi")]
pub struct UnknownDevice {
    /// What stood there.
    pub found: String,
}

impl FromStr for DeviceChoice {
    type Err = UnknownDevice;

    fn from_str(text: &str) -> Result<Self, UnknownDevice> {
        let number = |n: &str| n.parse().ok().map(Self::Adapter);
        let choice = match text {
            "auto" => Some(Self::Auto),
            "cpu" => Some(Self::Cpu),
            "gpu" => Some(Self::Gpu),
            "mpi" => Some(Self::Mpi),
            other => other.strip_prefix("gpu:").and_then(number),
        };
        choice.ok_or_else(|| UnknownDevice { found: text.to_owned() })
    }
}

/// The device that a run is trained on.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Device {
    /// "cpu", or the name of the adapter and its interface.
    pub name: String,
    /// Why it is not the device that would have been taken otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<String>,
}

impl Device {
    /// The CPU.
    pub fn cpu() -> Self {
        Self { name: "cpu".to_owned(), why: None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn devices_are_understood_by_their_names() {
        for (text, choice) in [
            ("auto", DeviceChoice::Auto),
            ("cpu", DeviceChoice::Cpu),
            ("gpu", DeviceChoice::Gpu),
            ("gpu:3", DeviceChoice::Adapter(3)),
        ] {
            assert_eq!(text.parse(), Ok(choice));
            assert_eq!(choice.to_string(), text);
        }
        for text in ["", "GPU", "gpu:", "gpu:-1", "gpu:x", "cuda"] {
            let error = text.parse::<DeviceChoice>().unwrap_err().to_string();
            assert!(error.contains("auto, cpu, gpu"), "{error}");
        }
    }
}
