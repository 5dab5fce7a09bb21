//! Damaged runs, options and command lines are used to the end or refused by one message, and nothing is lost.

#[path = "../common/mod.rs"]
mod common;
#[path = "../../../refraxel-data/tests/fixture/damage.rs"]
mod damage;
mod forged;
mod runs;
mod words;
