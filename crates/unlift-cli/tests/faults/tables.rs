//! Tables of the full version.

/// Prints a table in one write, because tests may run in parallel.
pub fn print(title: &str, header: &[&str], rows: &[Vec<String>]) {
    if !crate::full() {
        return;
    }
    let header: Vec<String> = header.iter().map(|&cell| cell.to_owned()).collect();
    let line = |row: &Vec<String>| format!("| {} |\n", row.join(" | "));
    let rule = format!("| {} |\n", vec!["---"; header.len()].join(" | "));
    let body: String = rows.iter().map(line).collect();
    println!("\n{title}\n\n{}{rule}{body}", line(&header));
}
