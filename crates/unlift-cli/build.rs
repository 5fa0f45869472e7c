//! Sets the version string, with the commit that was built if it is available.

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

/// Returns the commit from `UNLIFT_COMMIT`, else from git. Debug builds skip git, because each new commit would link them again.
fn commit() -> Option<String> {
    let given = std::env::var("UNLIFT_COMMIT").ok().filter(|commit| !commit.is_empty());
    if given.is_some() || std::env::var("PROFILE").ok()? != "release" {
        return given;
    }
    // If this crate lies in another repository, that repository's commit is not ours.
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
