//! Pieces of HTML. Text is escaped where it enters; everything else is markup of our own.

/// Text made safe as content and as an attribute in double quotes.
pub fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            _ => out.push(c),
        }
    }
    out
}

/// A paragraph of plain text.
pub fn paragraph(text: &str) -> String {
    format!("<p>{}</p>\n", escape(text))
}

/// A small remark under a chart or a table.
pub fn note(text: &str) -> String {
    format!("<p class=\"note\">{}</p>\n", escape(text))
}

/// A section with its heading and anchor; nothing if the body is empty.
pub fn section(id: &str, title: &str, body: &str) -> String {
    if body.is_empty() {
        return String::new();
    }
    format!("<section id=\"{id}\">\n<h2>{}</h2>\n{body}</section>\n", escape(title))
}

/// A chart with its caption.
pub fn figure(svg: &str, caption: &str) -> String {
    format!("<figure>\n{svg}<figcaption>{}</figcaption>\n</figure>\n", escape(caption))
}

/// A cell of a table.
pub struct Cell {
    text: String,
    class: &'static str,
    style: String,
}

impl Cell {
    /// Words, flush left.
    pub fn text(text: impl Into<String>) -> Self {
        Cell { text: text.into(), class: "t", style: String::new() }
    }

    /// A number, flush right.
    pub fn number(text: impl Into<String>) -> Self {
        Cell { text: text.into(), class: "n", style: String::new() }
    }

    /// A number with `digits` after the point; a dash for `None`.
    pub fn value(value: Option<f64>, digits: usize) -> Self {
        Cell::number(value.map_or("\u{2013}".to_owned(), |v| format!("{v:.digits$}")))
    }

    /// A ratio, coloured where it is more than the threshold of no change away from 1.
    pub fn ratio(ratio: Option<f64>) -> Self {
        use crate::paper::verdict::Effect;
        let class = match ratio.map(Effect::of) {
            Some(Effect::Saves) => "n good",
            Some(Effect::Costs) => "n bad",
            _ => "n",
        };
        Cell { class, ..Cell::value(ratio, 3) }
    }

    /// The same cell, stressed.
    pub fn strong(mut self) -> Self {
        self.class = if self.class.starts_with('t') { "t strong" } else { "n strong" };
        self
    }

    /// The same cell on a background of a ratio: green below 1, red above, stronger with distance.
    pub fn heat(mut self, ratio: f64) -> Self {
        /// The natural logarithm of the ratio at which the colour is full, a factor of 1.65.
        const FULL: f64 = 0.5;
        /// Largest share of the colour, in per cent, so that the text stays readable.
        const STRONGEST: f64 = 55.0;
        let depth = (ratio.ln() / FULL).clamp(-1.0, 1.0);
        let colour = if depth < 0.0 { "--good" } else { "--bad" };
        self.style = format!(
            "background:color-mix(in srgb,var({colour}) {:.0}%,transparent)",
            STRONGEST * depth.abs()
        );
        self
    }
}

/// A table that scrolls sideways on a narrow screen; the first column stays.
pub struct Table {
    html: String,
    columns: usize,
}

impl Table {
    /// A table with these column headings; the first is flush left.
    pub fn new(caption: &str, headings: &[&str]) -> Self {
        let mut html = String::from("<div class=\"scroll\"><table>\n");
        if !caption.is_empty() {
            html += &format!("<caption>{}</caption>\n", escape(caption));
        }
        html += "<thead><tr>";
        for (i, heading) in headings.iter().enumerate() {
            let class = if i == 0 { "t" } else { "n" };
            html += &format!("<th scope=\"col\" class=\"{class}\">{}</th>", escape(heading));
        }
        html += "</tr></thead>\n<tbody>\n";
        Table { html, columns: headings.len() }
    }

    /// Adds a row; `class` may be empty.
    pub fn row(&mut self, class: &str, cells: &[Cell]) {
        debug_assert_eq!(cells.len(), self.columns, "a row has a cell a column");
        self.html += &format!("<tr class=\"{class}\">");
        for (i, cell) in cells.iter().enumerate() {
            let (open, close) =
                if i == 0 { ("<th scope=\"row\"", "</th>") } else { ("<td", "</td>") };
            let style = match cell.style.as_str() {
                "" => String::new(),
                style => format!(" style=\"{style}\""),
            };
            let text = escape(&cell.text);
            self.html += &format!("{open} class=\"{}\"{style}>{text}{close}", cell.class);
        }
        self.html += "</tr>\n";
    }

    /// The table's HTML.
    pub fn finish(self) -> String {
        self.html + "</tbody>\n</table></div>\n"
    }
}

/// Checks that every element that is opened is closed in order.
///
/// # Errors
/// A sentence that names the element and what surrounds it.
#[cfg(test)]
pub fn check_balance(html: &str) -> Result<(), String> {
    const VOID: [&str; 3] = ["meta", "br", "!doctype"];
    let mut open = Vec::new();
    let mut rest = html;
    while let Some(start) = rest.find('<') {
        let end = rest[start..].find('>').ok_or("a tag without an end")? + start;
        let tag = &rest[start + 1..end];
        rest = &rest[end + 1..];
        let name: String = tag
            .trim_start_matches('/')
            .chars()
            .take_while(|c| !c.is_whitespace() && *c != '/')
            .collect::<String>()
            .to_lowercase();
        if tag.matches('"').count() % 2 == 1 || tag.contains('<') {
            return Err(format!("broken attributes in <{tag}>"));
        }
        if tag.starts_with('/') {
            match open.pop() {
                Some(last) if last == name => {}
                other => return Err(format!("</{name}> closes {other:?}")),
            }
        } else if !tag.ends_with('/') && !VOID.contains(&name.as_str()) {
            open.push(name);
        }
    }
    if open.is_empty() { Ok(()) } else { Err(format!("never closed: {open:?}")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_cannot_become_markup() {
        assert_eq!(escape("a<b> & \"c\""), "a&lt;b&gt; &amp; &quot;c&quot;");
        let mut table = Table::new("<i>", &["<b>", "n"]);
        table.row("", &[Cell::text("<script>"), Cell::value(Some(1.0), 2).heat(0.5)]);
        let html = table.finish();
        assert!(!html.contains("<script>") && !html.contains("<i>"));
        check_balance(&html).unwrap();
    }

    #[test]
    fn the_balance_check_sees_what_is_wrong() {
        assert!(check_balance("<p>a<b>c</b></p><br><path d=\"M0 0\"/>").is_ok());
        assert!(check_balance("<p><b></p></b>").is_err());
        assert!(check_balance("<p>").is_err());
        assert!(check_balance("</p>").is_err());
        assert!(check_balance("<p class=\"a>b</p>").is_err());
    }

    #[test]
    fn heat_has_a_sign_and_a_limit() {
        assert!(Cell::number("").heat(0.1).style.contains("--good) 55%"));
        assert!(Cell::number("").heat(9.0).style.contains("--bad) 55%"));
        assert!(Cell::number("").heat(1.0).style.contains(" 0%"));
    }
}
