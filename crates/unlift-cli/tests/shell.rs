//! What shells, manuals and reports of defects get.

mod common;

use common::Place;

#[test]
fn every_command_has_a_manual_page_and_every_shell_completes() {
    let place = Place::with_photos(&[]);
    for command in ["", "demo", "audit map", "neighbors find", "man"] {
        let page = place.ends(&format!("man {command}"), 0).0;
        let name = format!("unlift {command}").trim().replace(' ', "\\-");
        assert!(page.contains(&format!(".SH NAME\n{name} ")), "{command}: {page}");
    }
    let (_, stderr) = place.ends("man audit maps", 2);
    assert!(stderr.starts_with("unlift: unlift audit: expected one of map, images"), "{stderr}");
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let script = place.ends(&format!("completions {shell}"), 0).0;
        assert!(script.contains("oracle-noise") && script.contains("unlift"), "{shell}");
    }
}

#[test]
fn the_doctor_tells_what_a_report_of_a_defect_needs() {
    let place = Place::with_photos(&[]);
    let text = place.ends("doctor", 0).0;
    let names: Vec<&str> = text.lines().filter_map(|line| line.split_whitespace().next()).collect();
    assert_eq!(names, ["version", "instructions", "threads", "memory", "models", "browser"]);
    let object: serde_json::Value =
        serde_json::from_str(&place.ends("doctor --json", 0).0).unwrap();
    assert!(object["threads"].as_u64() > Some(0));
    let n_models = |name: &str| object[name].as_array().map_or(0, Vec::len);
    assert!(n_models("models") > 0 && n_models("models_missing") > 0, "{object}");
    assert!(object["version"].as_str().is_some_and(|v| v.starts_with(env!("CARGO_PKG_VERSION"))));
}

/// Without a terminal there is no color anyway; with one NO_COLOR is obeyed by what draws (clap, indicatif).
#[test]
fn nothing_is_colored_where_it_is_not_wanted() {
    let place = Place::with_photos(&[]);
    for line in ["--help", "audit map --help", "audit map missing.ply", "schemes"] {
        let output = std::process::Command::new(env!("CARGO_BIN_EXE_unlift"))
            .args(line.split(' '))
            .current_dir(place.path(""))
            .env("NO_COLOR", "1")
            .env("CLICOLOR_FORCE", "1")
            .output()
            .expect("it runs");
        let told = [output.stdout, output.stderr].concat();
        assert!(!told.contains(&0x1b), "{line}");
    }
}
