//! Runs Python scripts, if Python with pyarrow is installed.

use std::path::Path;
use std::process::Command;

pub fn python() -> Option<String> {
    let python = "python3".to_owned();
    let has = Command::new(&python).args(["-c", "import numpy, pyarrow.parquet"]).output();
    if has.is_ok_and(|output| output.status.success()) {
        return Some(python);
    }
    eprintln!("skipped: python3 with numpy and pyarrow is not installed");
    None
}

pub fn run(python: &str, folder: &Path, script: &str) -> String {
    let output = Command::new(python).args(["-c", script]).current_dir(folder).output().unwrap();
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{told}\nof the script\n{script}");
    String::from_utf8(output.stdout).unwrap()
}
