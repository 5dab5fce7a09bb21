//! The parameters that a folder was made with, so that an interrupted run can continue and a different one starts anew.

use super::super::error::SynthError;
use super::files::{clear_folder, io, remove_leftovers, write_whole};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::fs;
use std::path::Path;

/// Name of the manifest in the dataset's folder.
pub(super) const MANIFEST: &str = "manifest.json";

/// Folders that a run fills: pictures, then what lies beside them.
const PICTURES: [&str; 4] = ["train", "val", "test", "test_bg"];
const BESIDE: [&str; 4] = ["masks", "depth", "normals", "exr"];
const FILES: [&str; 9] = [
    "transforms.json",
    "photographs.json",
    "transforms_train.json",
    "transforms_val.json",
    "transforms_test.json",
    "transforms_test_bg.json",
    "scene.json",
    "index.npz",
    "contact.png",
];

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum State {
    /// Files of another run are being removed.
    Clearing,
    /// Pictures under their final names are whole and were made with `parameters`.
    Rendering,
    /// Everything is there.
    Complete,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Manifest {
    pub state: State,
    pub parameters: Value,
}

impl Manifest {
    pub(super) fn write(&self, folder: &Path) -> Result<(), SynthError> {
        let text = serde_json::to_string_pretty(self).unwrap_or_default();
        write_whole(&folder.join(MANIFEST), text.as_bytes())
    }

    fn read(folder: &Path) -> Result<Option<Manifest>, SynthError> {
        let path = folder.join(MANIFEST);
        match fs::read(&path) {
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(None),
            other => Ok(serde_json::from_slice(&other.map_err(io("read", &path))?).ok()),
        }
    }
}

/// Makes a folder ready for pictures made with `parameters`: pictures of an interrupted run with the same parameters stay,
/// those of any other run of this program are removed, and a folder with a dataset from elsewhere is refused.
pub(super) fn prepare(folder: &Path, parameters: &Value) -> Result<Manifest, SynthError> {
    let wanted = |state| Manifest { state, parameters: parameters.clone() };
    remove_leftovers(folder, |name| name == MANIFEST || FILES.contains(&name))?;
    for split in PICTURES {
        let beside = BESIDE.iter().map(|kind| folder.join(kind).join(split));
        beside.chain([folder.join(split)]).try_for_each(|f| remove_leftovers(&f, is_picture))?;
    }
    match Manifest::read(folder)? {
        Some(found) if found.parameters == reread(parameters) && found.state != State::Clearing => {
            return Ok(wanted(found.state));
        }
        Some(_) => {
            wanted(State::Clearing).write(folder)?;
            for split in PICTURES {
                clear_folder(&folder.join(split))?;
                BESIDE.iter().try_for_each(|kind| clear_folder(&folder.join(kind).join(split)))?;
            }
            for file in FILES.map(|f| folder.join(f)).iter().filter(|f| f.exists()) {
                fs::remove_file(file).map_err(io("remove", file))?;
            }
        }
        None => {
            let theirs = PICTURES.iter().chain(&FILES).chain([&MANIFEST]).find(|f| folder.join(f).exists());
            if let Some(file) = theirs {
                return Err(SynthError::Foreign { folder: folder.into(), file: (*file).into() });
            }
        }
    }
    let manifest = wanted(State::Rendering);
    manifest.write(folder)?;
    Ok(manifest)
}

/// `r_0.png`.
fn is_picture(name: &str) -> bool {
    let number = name.strip_prefix("r_").and_then(|rest| rest.split_once('.'));
    number.is_some_and(|(number, _)| number.bytes().all(|b| b.is_ascii_digit()))
}

/// A value as it comes back from a file: reading may change the last bit of a number.
fn reread(value: &Value) -> Value {
    serde_json::from_str(&value.to_string()).unwrap_or_default()
}
