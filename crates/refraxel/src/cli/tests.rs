use super::*;
use clap::{CommandFactory, FromArgMatches};
use refraxel_data::synth::{CameraSet, Imperfection};
use refraxel_data::{AlphaMeaning, Backdrop, MaskMeaning};

fn parse(line: &str) -> Result<Verb, clap::Error> {
    let matches = Cli::with_negative_numbers().try_get_matches_from(line.split(' '))?;
    Cli::from_arg_matches(&matches).map(|cli| cli.verb)
}

#[test]
fn definitions_are_consistent() {
    Cli::with_negative_numbers().debug_assert();
}

#[test]
fn each_example_of_the_help_is_accepted() {
    let mut examples = 0;
    let command = Cli::command();
    for verb in std::iter::once(&command).chain(command.get_subcommands()) {
        let help = verb
            .get_after_help()
            .unwrap_or_else(|| panic!("{} has no examples", verb.get_name()))
            .to_string();
        for line in help.lines().filter_map(|l| l.strip_prefix("  refraxel ")) {
            let words = line.split("  ").next().and_then(|l| l.split(" > ").next()).unwrap_or_default();
            let parsed = parse(&format!("refraxel {words}"));
            assert!(parsed.is_ok(), "{words}: {}", parsed.unwrap_err());
            examples += 1;
        }
    }
    assert!(examples >= 20, "{examples}");
}

#[test]
fn every_flag_has_help() {
    for verb in Cli::command().get_subcommands() {
        for flag in verb.get_arguments() {
            assert!(flag.get_help().is_some(), "{} {}", verb.get_name(), flag.get_id());
        }
    }
}

#[test]
fn train_understands_the_contract() {
    let line = "refraxel train photos --out run --refraction off --set a=1 --set b.c=x=y --config c.toml --resume \
                --threads 2 --seed 7 --minutes 0.5 --holdout 10 --mask-meaning keep --backdrop #00ff00 --alpha ignore \
                --allow-outside --json";
    let Ok(Verb::Train(args)) = parse(line) else { panic!("refused") };
    assert_eq!((args.refraction, args.seed, args.minutes), (Refraction::Off, Some(7), Some(0.5)));
    assert_eq!(args.settings[1], Setting { key: "b.c".into(), value: "x=y".into() });
    assert_eq!((args.reading.holdout, args.reading.mask_meaning), (Some(10), Some(MaskMeaning::Keep)));
    let (backdrop, alpha) = (args.reading.backdrop, args.reading.alpha);
    assert_eq!((backdrop, alpha), (Some(Backdrop::Color([0.0, 1.0, 0.0])), Some(AlphaMeaning::Ignore)));
    assert!(
        parse("refraxel inspect photos --backdrop sky").is_err()
            && parse("refraxel inspect photos --alpha no").is_err()
    );
    assert_eq!(args.work.threads, Some(2));
    assert!(parse("refraxel train --options --json").is_ok());
    assert!(args.resume && args.reading.allow_outside && args.work.json);
}

#[test]
fn refraction_is_automatic_by_default() {
    let Ok(Verb::Train(args)) = parse("refraxel train photos --out run") else { panic!("refused") };
    assert_eq!((args.refraction, args.seed), (Refraction::Auto, None));
}

#[test]
fn nonsense_is_a_usage_error() {
    for line in [
        "refraxel train",
        "refraxel train photos",
        "refraxel train photos --out run --markdown",
        "refraxel train --options --markdown --json",
        "refraxel train photos --out run --set steps",
        "refraxel train photos --out run --set =3",
        "refraxel train photos --out run --minutes -1",
        "refraxel train photos --out run --minutes NaN",
        "refraxel train photos --out run --threads 0",
        "refraxel train photos --out run --threads 100000",
        "refraxel train photos --out run --seed -1",
        "refraxel train photos --out run --holdout 1",
        "refraxel render run --out views",
        "refraxel render run --orbit 5 --cameras c.json --out views",
        "refraxel render run --slices",
        "refraxel render run --orbit 5 --out views --paths 0",
        "refraxel render run --orbit 5 --out views --set-index 9",
        "refraxel render run --orbit 5 --out views --scale-index -1",
        "refraxel render run --orbit 5 --out views --scale-index 2 --set-index 1.5",
        "refraxel compare",
        "refraxel synth sphere",
        "refraxel synth sphere --list",
        "refraxel synth sphere --out s --size 0x4",
        "refraxel synth sphere --out s --size 64x48",
        "refraxel synth sphere --out s --ior inf",
        "refraxel completions cobol",
    ] {
        assert_eq!(parse(line).expect_err(line).exit_code(), 2, "{line}");
    }
}

#[test]
fn a_negative_number_is_refused_as_a_number() {
    for flag in ["--seed", "--minutes", "--threads", "--holdout"] {
        let refusal = parse(&format!("refraxel train photos --out run {flag} -1")).unwrap_err().to_string();
        assert!(refusal.contains("invalid value '-1' for") && !refusal.contains("tip:"), "{refusal}");
    }
    assert!(parse("refraxel train -p --out run").is_err(), "only numbers may begin with a dash");
}

#[test]
fn render_outputs_are_separated_by_commas() {
    let Ok(Verb::Render(args)) = parse("refraxel render run --orbit 3 --out d --outputs depth,opacity")
    else {
        panic!("refused")
    };
    assert_eq!(args.outputs, [Layer::Depth, Layer::Opacity]);
}

#[test]
fn synth_understands_the_contract() {
    let line = "refraxel synth glass_ball --out s --size 64 --views 20 --seed 3 --ior 1.4 --reflection off --cameras full \
                --spp 4 --detail-spp 0 --index-resolution 16 --exr --threads 2";
    let Ok(Verb::Synth(args)) = parse(line) else { panic!("refused") };
    assert_eq!((args.size, args.views, args.cameras), (Some(64), Some(20), CameraSet::Full));
    assert!(parse("refraxel synth --list --json").is_ok());
}

#[test]
fn photographs_leave_out_imperfections_by_their_names() {
    let line = "refraxel synth kitchen_bear --out s --photographic --without noise,jpeg";
    let Ok(Verb::Synth(args)) = parse(line) else { panic!("refused") };
    assert_eq!(args.without, [Imperfection::Noise, Imperfection::Jpeg]);
    for refused in ["--without noise", "--photographic --without blur", "--photographic --exr"] {
        assert!(parse(&format!("refraxel synth kitchen_bear --out s {refused}")).is_err(), "{refused}");
    }
}
