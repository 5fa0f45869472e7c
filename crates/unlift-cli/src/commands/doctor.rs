//! `unlift doctor`: what this machine and this program have.

use serde_json::json;
use unlift::simd::instructions;
use unlift_audit::total_bytes;
use unlift_nn::{Folders, MODELS};

use crate::args::DoctorArgs;
use crate::exit::Outcome;
use crate::output::print;

/// Programs that show a report.
const BROWSERS: [&str; 6] =
    ["firefox", "chromium", "chromium-browser", "google-chrome", "microsoft-edge", "xdg-open"];

/// Tells version, instructions, threads, memory, models and what would open a page.
pub fn run(args: &DoctorArgs) -> anyhow::Result<Outcome> {
    let folders = Folders::of_process();
    let (mut here, mut missing) = (Vec::new(), Vec::new());
    for entry in MODELS {
        let is_here = folders.find(entry)?.is_some();
        if is_here { &mut here } else { &mut missing }.push(entry.name);
    }
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let memory = total_bytes();
    let browser = BROWSERS.into_iter().find(|name| is_on_path(name));
    let (system, machine) = (std::env::consts::OS, std::env::consts::ARCH);
    let build = if cfg!(debug_assertions) { "debug" } else { "release" };
    let version = env!("UNLIFT_VERSION");
    let text = if args.json {
        let object = json!({
            "version": version,
            "build": build,
            "system": system,
            "machine": machine,
            "instructions": instructions(),
            "threads": threads,
            "memory_bytes": memory,
            "models": here,
            "models_missing": missing,
            "browser": browser,
        });
        serde_json::to_string_pretty(&object)? + "\n"
    } else {
        let memory = memory.map_or_else(
            || "not known here".to_owned(),
            |bytes| format!("{:.1} GiB", bytes as f64 / f64::from(1 << 30)),
        );
        let absent = match missing.as_slice() {
            [] => String::new(),
            missing => {
                format!("; not here: {} (unlift models says where they belong)", missing.join(", "))
            }
        };
        let page = match browser {
            Some(name) => format!("{name} opens reports"),
            None => {
                "none found on the path: open report.html by hand, it needs no network".to_owned()
            }
        };
        format!(
            "version       {version}, {build}, {system} on {machine}\n\
             instructions  {} (results are the same with any)\n\
             threads       {threads}\n\
             memory        {memory}\n\
             models        {}{absent}\n\
             browser       {page}\n",
            instructions(),
            here.join(", "),
        )
    };
    print(&text)?;
    Ok(Outcome::Done)
}

fn is_on_path(name: &str) -> bool {
    let folders = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&folders).any(|folder| folder.join(name).is_file())
}
