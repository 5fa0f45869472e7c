//! Templates of pages and other files, with the filters of their text.

use minijinja::value::{Serde, Value};
use minijinja::{AutoEscape, Environment, UndefinedBehavior};

use crate::document::Error;
use crate::words;

/// Renders the first of `sources`, which includes the others by their names. Text is escaped in HTML; an undefined name is an error.
pub(crate) fn render(
    sources: &[(&'static str, &'static str)],
    values: &serde_json::Value,
) -> Result<String, Error> {
    let mut env = Environment::new();
    env.set_undefined_behavior(UndefinedBehavior::Strict);
    env.set_auto_escape_callback(|name| match name.ends_with(".html") {
        true => AutoEscape::Html,
        false => AutoEscape::None,
    });
    env.add_filter("thousands", |count: u64| words::thousands(count));
    env.add_filter("percent", |value: f64| words::percent(value));
    env.add_filter("signed", |value: f64| format!("{value:+.1}"));
    env.add_filter("tied", tied);
    env.add_filter("coded", coded);
    env.add_filter("xml", |text: &str| escaped(text));
    for (name, source) in sources {
        env.add_template(name, source)?;
    }
    Ok(env.get_template(sources[0].0)?.render(Serde(values))?)
}

/// Keeps figures and their units on one line, by non-breaking spaces.
fn tied(text: Value) -> Result<Value, minijinja::Error> {
    // Filters of strings refuse what is undefined, but a string would lose that it is markup.
    if text.is_undefined() {
        return Err(minijinja::ErrorKind::UndefinedError.into());
    }
    let mut tied = text.to_string();
    for unit in [" %", " cm", " px"] {
        tied = tied.replace(unit, &unit.replace(' ', "\u{a0}"));
    }
    Ok(if text.is_safe() { Value::from_safe_string(tied) } else { tied.into() })
}

/// Escapes text, with parts in back quotes as code.
fn coded(text: &str) -> Value {
    let escaped = text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    let parts = escaped.split('`').enumerate();
    let parts = parts.map(|(at, part)| match at % 2 {
        1 => format!("<code>{part}</code>"),
        _ => part.to_owned(),
    });
    Value::from_safe_string(parts.collect())
}

/// Escapes text for XML content and quoted attributes. Characters that XML 1.0 does not allow become U+FFFD.
fn escaped(text: &str) -> String {
    let escape = |c: char| match c {
        '&' => "&amp;".to_owned(),
        '<' => "&lt;".to_owned(),
        '>' => "&gt;".to_owned(),
        '"' => "&quot;".to_owned(),
        // Unescaped, they would become spaces in attributes.
        '\t' | '\n' | '\r' => format!("&#{};", u32::from(c)),
        '\0'..='\x1f' | '\u{fffe}' | '\u{ffff}' => '\u{fffd}'.to_string(),
        _ => c.to_string(),
    };
    text.chars().map(escape).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_xml_would_read_as_its_own_is_escaped() {
        assert_eq!(escaped("a<b> & \"c\""), "a&lt;b&gt; &amp; &quot;c&quot;");
        assert_eq!(escaped("ü\n\x1b"), "ü&#10;\u{fffd}");
    }
}
