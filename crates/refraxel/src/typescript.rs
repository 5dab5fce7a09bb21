//! The types of messages for the pages, as TypeScript.

use crate::{start, viewer};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use ts_rs::{Config, TS, TypeVisitor};

/// Declarations by name: of what is visited, and of everything in it that has a name of its own.
struct Types {
    config: Config,
    declared: BTreeMap<String, String>,
}

impl TypeVisitor for Types {
    fn visit<T: TS + ?Sized + 'static>(&mut self) {
        if T::output_path().is_none() {
            return T::visit_dependencies(self); // a number, a list, a box
        }
        let declared = format!("{}export {}\n", T::docs().unwrap_or_default(), T::decl(&self.config));
        // Each comment in one line, no spaces at the ends of lines.
        let declared = declared.replace("/**\n * ", "/** ").replace("\n */\n", " */\n").replace(" \n", "\n");
        if self.declared.insert(T::ident(&self.config), declared).is_none() {
            T::visit_dependencies(self);
        }
    }
}

impl Types {
    fn new() -> Self {
        // All numbers here are far below 2⁵³.
        Self { config: Config::new().with_large_int("number"), declared: BTreeMap::new() }
    }

    /// With a type.
    fn with<T: TS + 'static>(mut self) -> Self {
        self.visit::<T>();
        self
    }

    /// Fails unless the file in `viewer/` has these types and nothing else. It has them for the next time.
    #[track_caller]
    fn are_in(self, file: &str) {
        let head = "// What the page and the program say to each other: the types of the program, written by its test `typescript`.\n";
        let types: Vec<String> = self.declared.into_values().collect();
        let text = format!("{head}\n{}", types.join("\n"));
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../viewer").join(file);
        let found = fs::read_to_string(&path).unwrap_or_default().replace("\r\n", "\n");
        if found != text {
            fs::write(&path, text).unwrap();
            panic!(
                "viewer/{file} had other types than the program; it is written anew: build the page and commit both"
            );
        }
    }
}

#[test]
fn the_page_of_a_scene_has_the_types_of_the_program() {
    use viewer::{Ask, Header, Tell};
    Types::new().with::<Ask>().with::<Tell>().with::<Header>().are_in("src/protocol.ts");
}

#[test]
fn the_start_page_has_the_types_of_the_program() {
    use start::protocol::{Ask, Tell};
    Types::new().with::<Ask>().with::<Tell>().are_in("start/protocol.ts");
}
