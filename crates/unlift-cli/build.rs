//! The version with the commit that it was built from, where that is known.

use std::path::Path;
use std::process::Command;

fn main() {
    let version = std::env::var("CARGO_PKG_VERSION").expect("set by cargo");
    println!("cargo::rerun-if-env-changed=UNLIFT_COMMIT");
    println!("cargo::rerun-if-changed=build.rs");
    let named = match commit() {
        Some(commit) => format!("{version} ({commit})"),
        None => version,
    };
    println!("cargo::rustc-env=UNLIFT_VERSION={named}");
}

/// As packagers give it, else as git says; not of debug builds, which would be linked anew for every commit.
fn commit() -> Option<String> {
    let given = std::env::var("UNLIFT_COMMIT").ok().filter(|commit| !commit.is_empty());
    if given.is_some() || std::env::var("PROFILE").ok()? != "release" {
        return given;
    }
    // Of a published crate within somebody else's repository, its commit is not ours.
    git(&["ls-files", "--error-unmatch", "build.rs"])?;
    let log = git(&["rev-parse", "--git-path", "logs/HEAD"])?;
    if Path::new(&log).is_file() {
        println!("cargo::rerun-if-changed={log}");
    }
    git(&["rev-parse", "--short=12", "HEAD"])
}

fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
}
