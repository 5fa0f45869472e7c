//! Tests that the command lines in `docs/examples` parse.

use std::fs;
use std::path::Path;

use super::Cli;

fn example(name: &str) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/examples");
    fs::read_to_string(folder.join(name)).expect(name)
}

/// Returns the unlift command lines of a YAML file: items of lists, values of `run`, and comments.
fn command_lines(text: &str) -> Vec<Vec<String>> {
    let command = |line: &str| {
        let line = line.trim_start_matches(['-', ' ', '#']);
        let line = line.strip_prefix("run: ").unwrap_or(line);
        let line = line.split(" #").next().unwrap_or_default().trim();
        assert!(!line.contains(['\'', '|']), "this test does not read quotes and pipes: {line}");
        // After `docker run`, unlift is the name of the image.
        let ours = line.split_once("docker run ").and_then(|(_, rest)| rest.split_once(" unlift "));
        let ours = ours.map(|(_, rest)| format!("unlift {rest}"));
        ours.or_else(|| line.starts_with("unlift ").then(|| line.to_owned()))
    };
    let lines = text.lines().filter_map(command);
    lines.map(|line| line.split_whitespace().map(str::to_owned).collect()).collect()
}

/// Parses an instruction of a Dockerfile with a list of words, such as `CMD ["check"]`.
fn listed(text: &str, instruction: &str) -> Vec<String> {
    let line = text.lines().find_map(|line| line.strip_prefix(instruction)).expect(instruction);
    serde_json::from_str(line.trim()).expect("a list of words")
}

#[test]
fn every_command_line_of_the_examples_is_one() {
    for (name, n) in [("github-action.yml", 1), ("gitlab-ci.yml", 1), ("Dockerfile", 1)] {
        let lines = command_lines(&example(name));
        assert_eq!(lines.len(), n, "{name}: {lines:?}");
        for line in lines {
            Cli::read(&line).unwrap_or_else(|error| panic!("{name}: {line:?}: {error}"));
        }
    }
    let dockerfile = example("Dockerfile");
    let whole = [listed(&dockerfile, "ENTRYPOINT"), listed(&dockerfile, "CMD")].concat();
    assert_eq!(whole, ["unlift", "check"]);
    Cli::read(&whole).expect("what a container runs");
}

#[test]
fn what_the_examples_build_is_here() {
    let manifest = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("Cargo.toml"));
    assert!(manifest.unwrap().contains("name = \"unlift-cli\"\n"));
    let rust = format!("rust:{}-", env!("CARGO_PKG_RUST_VERSION"));
    for name in ["Dockerfile", "gitlab-ci.yml"] {
        assert!(example(name).contains(&rust), "{name}: the least version that builds it");
    }
    let dockerfile = example("Dockerfile");
    assert!(dockerfile.contains("--path /unlift/crates/unlift-cli "), "{dockerfile}");
    for name in ["github-action.yml", "gitlab-ci.yml"] {
        assert!(
            example(name).contains(&format!("--git {} unlift-cli", env!("CARGO_PKG_REPOSITORY")))
        );
    }
}

#[test]
fn outputs_of_the_configuration_are_what_builds_pick_up() {
    let config = example("unlift.toml");
    for line in config.lines().filter(|line| line.starts_with("out ") || line.contains("junit =")) {
        assert!(line.contains("= \"audits/"), "{line}");
    }
    assert!(example("gitlab-ci.yml").contains("junit: audits/*.xml\n"));
}
