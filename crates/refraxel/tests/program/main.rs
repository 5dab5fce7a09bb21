//! The program as people use it, and what its documents say of it. One test program, which is linked once and whose tests share the
//! processors. Tests that limit their memory, end their process, need a device or take minutes have programs of their own.

#[path = "../common/mod.rs"]
mod common;

mod bad_input;
mod docs;
mod exporting;
mod far;
mod filming;
mod importing;
mod inspecting;
mod keeping;
mod kills;
mod manual;
mod masking;
mod pages;
mod runs;
mod seeing;
mod starting;
mod verbs;
mod viewing;
