//! As much of Rust's syntax as it takes to find paths and words in code.

/// A source file of the core: its path from `src/`, and its text without comments and literals.
pub struct Source {
    /// With `/` on every platform.
    pub path: String,
    /// What [`code_of`] leaves.
    pub code: String,
}

/// `text` without comments, strings and characters: what is left is code. Lifetimes lose their
/// quote, so that `'static` is not an item.
pub fn code_of(text: &str) -> String {
    let chars: Vec<char> = text.chars().collect();
    let mut code = String::new();
    let mut at = 0;
    while at < chars.len() {
        let next = chars.get(at + 1).copied().unwrap_or(' ');
        match chars[at] {
            '/' if next == '/' => {
                while at < chars.len() && chars[at] != '\n' {
                    at += 1;
                }
            }
            '"' => {
                at += 1;
                while at < chars.len() && chars[at] != '"' {
                    at += if chars[at] == '\\' { 2 } else { 1 };
                }
                at += 1;
                code.push(' ');
            }
            '\'' if next == '\\' || chars.get(at + 2) == Some(&'\'') => {
                at += if next == '\\' { 3 } else { 2 };
                while at < chars.len() && chars[at] != '\'' {
                    at += 1;
                }
                at += 1;
            }
            '\'' => {
                code.push_str(" lifetime_");
                at += 1;
            }
            other => {
                code.push(other);
                at += 1;
            }
        }
    }
    code
}

/// Where a `pub use` of any visibility begins and ends.
fn exports(code: &str) -> Vec<(usize, usize)> {
    let mut found = Vec::new();
    for (at, _) in code.match_indices("use ") {
        let before = code[..at].trim_end();
        let visibility = before.rfind("pub").map(|from| &before[from + 3..]).unwrap_or("no");
        let is_pub = visibility.is_empty()
            || visibility.starts_with('(') && visibility.find(')') == Some(visibility.len() - 1);
        if is_pub && let Some(end) = code[at..].find(';') {
            found.push((at, at + end + 1));
        }
    }
    found
}

/// What `code` only hands on: its `pub use` lines, without their visibility.
pub fn exported(code: &str) -> String {
    exports(code).into_iter().map(|(from, to)| &code[from..to]).collect()
}

/// `code` without what it only hands on.
pub fn without_exports(code: &str) -> String {
    let (mut left, mut at) = (String::new(), 0);
    for (from, to) in exports(code) {
        left.push_str(&code[at..from]);
        at = to;
    }
    left + &code[at..]
}

/// Words, `::`, and every other character by itself.
pub fn tokens(code: &str) -> Vec<String> {
    let mut tokens: Vec<String> = Vec::new();
    let mut word = String::new();
    for c in code.chars().chain([' ']) {
        if c.is_alphanumeric() || c == '_' {
            word.push(c);
            continue;
        }
        if !word.is_empty() {
            tokens.push(std::mem::take(&mut word));
        }
        match c {
            ':' if tokens.last().is_some_and(|last| last == ":") => {
                tokens.pop();
                tokens.push("::".to_owned());
            }
            c if c.is_whitespace() => {}
            c => tokens.push(c.to_string()),
        }
    }
    tokens
}

/// Every path of `code` that starts with one of `roots`, `use` trees spread out.
pub fn paths(code: &str, roots: &[&str]) -> Vec<Vec<String>> {
    let tokens = tokens(code);
    let mut found = Vec::new();
    for at in 0..tokens.len() {
        let starts = roots.contains(&tokens[at].as_str())
            && tokens.get(at + 1).is_some_and(|t| t == "::")
            && (at == 0 || tokens[at - 1] != "::");
        if starts {
            spread(&tokens, at, &mut Vec::new(), &mut found);
        }
    }
    found
}

/// Appends the paths of the tree at `at` under `prefix`; returns where it ends.
fn spread(
    tokens: &[String],
    mut at: usize,
    prefix: &mut Vec<String>,
    found: &mut Vec<Vec<String>>,
) -> usize {
    let depth = prefix.len();
    loop {
        match tokens.get(at).map(String::as_str) {
            Some("{") => {
                at += 1;
                while tokens.get(at).is_some_and(|t| t != "}") {
                    at = spread(tokens, at, prefix, found);
                    while tokens.get(at).is_some_and(|t| t != "," && t != "}") {
                        at += 1;
                    }
                    at += usize::from(tokens.get(at).is_some_and(|t| t == ","));
                }
                at += 1;
                break;
            }
            Some(name) => prefix.push(name.to_owned()),
            None => break,
        }
        at += 1;
        if tokens.get(at).is_none_or(|t| t != "::") {
            found.push(prefix.clone());
            break;
        }
        at += 1;
    }
    prefix.truncate(depth);
    at
}

/// Paths into the crate itself, from its root: `super` and `self` are resolved. Inside an inline
/// module one `super` leads to the file; resolved from the file it names a module further up, in
/// the same stage or the root, which is allowed anyway.
pub fn internal_paths(source: &Source) -> Vec<Vec<String>> {
    let mut module: Vec<&str> = source.path.trim_end_matches(".rs").split('/').collect();
    if module.last() == Some(&"mod") {
        module.pop();
    }
    let mut found = Vec::new();
    for path in paths(&source.code, &["crate", "super", "self", "unlift"]) {
        let absolute = ["crate", "unlift"].contains(&path[0].as_str());
        let mut base: Vec<String> = module.iter().map(|&m| m.to_owned()).collect();
        for name in path {
            match name.as_str() {
                "crate" | "unlift" => base.clear(),
                "self" => {}
                "*" if !absolute => {}
                "super" => {
                    base.pop();
                }
                _ => base.push(name),
            }
        }
        if !base.is_empty() {
            found.push(base);
        }
    }
    found
}
