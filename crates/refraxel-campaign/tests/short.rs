//! A short campaign, and all that it once found. `just campaign` runs a long one.

use std::path::Path;
use std::process::{Command, Output};

fn campaign(words: &[&str], out: &Path) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_campaign"));
    command.args(words).args(["--out", &out.display().to_string()]).output().unwrap()
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&[output.stdout.clone(), output.stderr.clone()].concat()).into_owned()
}

#[test]
fn a_short_campaign_finds_nothing() {
    let out = tempfile::tempdir().unwrap();
    // Cases instead of seconds: the same on every machine.
    let ran = campaign(&["fuzz", "--cases", "12", "--seconds", "100000", "--seed", "11"], out.path());
    assert!(ran.status.success(), "{}", said(&ran));
    let report = std::fs::read_to_string(out.path().join("fuzz.json")).unwrap();
    let tallies: Vec<serde_json::Value> = serde_json::from_str(&report).unwrap();
    assert!(tallies.len() > 30, "{} targets", tallies.len());
    for tally in tallies {
        let counts = ["used", "refused"].map(|key| tally[key].as_u64().unwrap());
        assert_eq!(counts.iter().sum::<u64>(), 12, "{tally}");
    }
}

#[test]
fn a_case_is_the_same_every_time() {
    let changes = || refraxel_campaign::fuzz::changes("obj", 3, 17);
    assert_eq!(changes(), changes());
    assert_ne!(changes(), refraxel_campaign::fuzz::changes("obj", 3, 18));
    assert_ne!(changes(), refraxel_campaign::fuzz::changes("ply", 3, 17));
}

#[test]
fn stored_inputs_are_used_or_refused() {
    let ran = Command::new(env!("CARGO_BIN_EXE_campaign")).arg("replay-all").output().unwrap();
    assert!(ran.status.success(), "{}", said(&ran));
}
