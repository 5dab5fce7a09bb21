use super::gone::GONE;
use super::*;
use refraxel_core::Extent;
use serde_json::{Value, json};

fn set(key: &str, value: &str) -> Result<Options, OptionError> {
    let mut options = Options::default();
    options.set(key, value)?;
    Ok(options)
}

fn refusal(key: &str, value: &str) -> String {
    set(key, value).unwrap_err().to_string()
}

fn read(tree: Value) -> Result<Options, String> {
    serde_json::from_value(tree).map_err(|e| e.to_string())
}

#[test]
fn settings_change_options_and_the_last_one_counts() {
    let mut options = Options::default();
    for (key, value) in [("run.steps", "7"), ("rate_density", "0.5"), ("steps", "9")] {
        assert_eq!(options.set(key, value), Ok(()));
    }
    assert_eq!((options.run.steps, options.field.rate_density), (9, 0.5));
}

#[test]
fn every_default_is_allowed_and_survives_a_round_trip() {
    let usual = Options::default().checked().unwrap();
    let mut options = Options::default();
    for (option, value) in Options::definitions().iter().zip(usual.values()) {
        assert_eq!(options.set(option.name, &value), Ok(()));
    }
    assert_eq!(options, usual);
    let stored = serde_json::to_value(Options::suited_to(Extent::Contracted, false)).unwrap();
    assert_eq!(stored["field"]["tv_density"].as_f64().map(|v| v as f32), Some(1e-4));
    assert_eq!(read(stored), Ok(Options::suited_to(Extent::Contracted, false)));
}

#[test]
fn every_word_survives_a_round_trip() {
    let words = |option: &Definition| match option.allowed {
        Allowed::Words(words) => words.iter().map(|w| w.word).collect(),
        _ => Vec::new(),
    };
    let mut found = 0;
    for option in Options::definitions() {
        for word in words(&option) {
            let options = set(option.name, word).unwrap();
            assert_eq!(read(serde_json::to_value(&options).unwrap()), Ok(options));
            found += 1;
        }
    }
    assert!(found > 30, "{found}");
}

#[test]
fn mistakes_are_named() {
    for (key, value, message) in [
        ("run.steps", "7.5", "option `run.steps` is `7.5`, expected a whole number, 1 or more"),
        ("steps", "0", "option `run.steps` is `0`, expected a whole number, 1 or more"),
        ("sh_degree", "4", "option `field.sh_degree` is `4`, expected a whole number, 0 to 3"),
        ("rate_density", "NaN", "option `field.rate_density` is `NaN`, expected a number, 0 to 100"),
        ("march.step", "0", "option `march.step` is `0`, expected a number, 0.05 to 4 voxels"),
        ("seed", "x", "option `run.seed` is `x`, expected any whole number"),
        (
            "profile",
            "soft",
            "`search.profile` is `soft`, expected one of `auto`, `sharp`, `smooth`, `graded`",
        ),
        ("reflection.cache", "black", "`black`, expected one of `learned`, `exact`"),
        ("refraction.bounds", "0,0,0,1,1", "expected x0,y0,z0,x1,y1,z1 with x0 < x1"),
    ] {
        let refusal = refusal(key, value);
        assert!(refusal.contains(message), "{refusal}");
    }
}

#[test]
fn unknown_names_get_a_suggestion_and_ambiguous_ones_a_choice() {
    assert!(refusal("surface.blurr", "1").contains("(did you mean `surface.blur`?)"));
    assert!(refusal("stepz", "7").starts_with("unknown option `stepz` (did you mean `run.steps`?)"));
    assert!(refusal("training.steps", "7").contains("did you mean `run.steps`?"));
    assert!(!refusal("xyzzy", "7").contains("did you mean"));
    let rate = refusal("rate", "1");
    assert!(rate.contains("`index.rate`, `surface.rate`"), "{rate}");
}

#[test]
fn options_must_fit_together() {
    let mut options = set("shape.start", "file").unwrap();
    assert!(options.clone().checked().is_ok());
    options.surface.blur = 9.0;
    assert!(options.checked().unwrap_err().to_string().contains("`surface.blur` is `9`"));
}

#[test]
fn options_that_are_gone_are_no_options_and_are_told() {
    let names: Vec<&str> = Options::definitions().iter().map(|o| o.name).collect();
    let mut gone: Vec<&str> = GONE.iter().map(|g| g.name).collect();
    assert!(gone.iter().all(|name| !names.contains(name)));
    gone.sort_unstable();
    assert!(gone.windows(2).all(|pair| pair[0] != pair[1]), "{gone:?}");
    assert!(refusal("rate_decay", "1").contains("RATE_DECAY"), "also without its section");
    for option in GONE {
        let refusal = refusal(option.name, "1");
        assert!(refusal.contains(option.name) && refusal.contains(option.now), "{refusal}");
    }
}

#[test]
fn the_constants_that_took_the_place_of_options_are_where_their_errors_say() {
    let sources = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut found = 0;
    for option in GONE {
        let Some((constant, file)) =
            option.now.strip_prefix("the constant ").and_then(|c| c.split_once(" of "))
        else {
            continue;
        };
        let text = std::fs::read_to_string(sources.join(file)).unwrap();
        assert!(text.contains(&format!("const {constant}: ")), "{}: {constant} of {file}", option.name);
        found += 1;
    }
    assert!(found > 40, "{found}");
}

#[test]
fn stored_runs_may_have_had_the_values_that_are_constants_now() {
    for option in GONE {
        for was in option.was {
            let value = was.parse::<f32>().map_or_else(|_| json!(was), |v| json!(v));
            assert_eq!(read(json!({ option.name: value })), Ok(Options::default()), "{}", option.name);
        }
        let other = read(json!({ option.name: 123_456 }));
        assert_eq!(other.is_ok(), option.was.is_empty(), "{}: {other:?}", option.name);
    }
}

#[test]
fn tables_and_full_names_say_the_same() {
    let bounds = json!([-0.5, -0.5, 0, 0.5, 0.5, 1]);
    let nested =
        json!({ "surface": { "blur": 2.0 }, "refraction": { "bounds": bounds, "bend": "on" }, "steps": 5 });
    let mut options = Options::default();
    assert_eq!(options.set_tree(&nested), Ok(()));
    let dotted = json!({
        "surface.blur": 2, "refraction.bounds": "-0.5,-0.5,0,0.5,0.5,1", "refraction.bend": "on", "run.steps": 5,
    });
    let mut same = Options::default();
    same.set_tree(&dotted).unwrap();
    assert_eq!(options, same);
    assert_eq!(options.refraction.stated_box().unwrap().max.z, 1.0);
    assert!(options.set_tree(&json!(3)).is_err());
}

#[test]
fn differences_name_the_option_and_both_values() {
    let here = set("surface.blur", "2").unwrap();
    let difference = Difference { name: "surface.blur", here: "2".to_owned(), there: "1.5".to_owned() };
    assert_eq!(here.differences(&Options::default()), [difference]);
}

#[test]
fn the_list_says_what_is_usual_for_surroundings_without_bounds() {
    let defaults = |name: &str| list().into_iter().find(|o| o.name == name).map(|o| (o.default, o.unbounded));
    let named = |text: &str| Some(text.to_owned());
    assert_eq!(defaults("march.min_transmittance"), Some(("0.001".to_owned(), named("0.01"))));
    assert_eq!(defaults("grid.prune_weight"), Some(("0.005".to_owned(), None)));
    assert!(list_as_text().contains("  march.min_transmittance = 0.001; unbounded 0.01  ("));
    assert!(list_as_text().contains("  field.rate_density = 1; unbounded 0.3; forward-facing 1  ("));
}

#[test]
fn density_in_a_box_is_smoothed_less_where_nothing_is_known_to_refract() {
    let [unknown, told] = [false, true].map(|is_told| Options::suited_to(Extent::Bounded, is_told).field);
    assert_eq!(unknown, FieldOptions { tv_density: told.tv_density / 5.0, ..told });
}

#[test]
fn every_option_is_listed_with_a_sentence() {
    let listed = list();
    assert_eq!(listed.len(), Options::definitions().len());
    for option in &listed {
        assert!(option.meaning.ends_with('.') && !option.range.is_empty(), "{option:?}");
        assert!(list_as_text().contains(option.name) && list_as_markdown().contains(&option.meaning));
    }
}
