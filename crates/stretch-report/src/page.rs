//! The frame of every report: one HTML file that needs no network, for light and dark screens, phones and paper.

use std::fmt::Write as _;

use super::{figure::Figure, live::embedded, markup::escape, script};

/// In tables with at least this many columns, each row becomes a card on a phone.
const CARDS: usize = 4;
/// The text of a cell wraps if it has more letters than this.
const WORDS: usize = 24;

/// The style of the page: colours, fonts, and rules for phones and printers.
const STYLE: &str = include_str!("style.css");

/// A table: the first column names its rows, the others hold numbers.
#[derive(Debug, Clone, Default)]
pub struct Table {
    /// Caption of the table.
    pub caption: String,
    /// Heads of the columns.
    pub head: Vec<String>,
    /// Cells, row by row.
    pub rows: Vec<Vec<String>>,
    /// The row to look at first.
    pub highlight: Option<usize>,
}

impl Table {
    /// Creates a table without a highlighted row.
    pub fn new(
        caption: impl Into<String>,
        head: &[&str],
        rows: impl IntoIterator<Item = Vec<String>>,
    ) -> Self {
        let head = head.iter().map(|&name| name.to_owned()).collect();
        Self { caption: caption.into(), head, rows: rows.into_iter().collect(), highlight: None }
    }

    /// Returns the table with a row to look at first.
    #[must_use]
    pub fn highlight(self, row: impl Into<Option<usize>>) -> Self {
        Self { highlight: row.into(), ..self }
    }
}

/// A report under construction; [`Page::finish`] gives the file.
#[derive(Debug, Clone)]
pub struct Page {
    title: String,
    body: String,
    in_section: bool,
}

impl Page {
    /// A page whose first words are its title and one plain sentence with the result.
    pub fn new(title: &str, verdict: &str) -> Self {
        let body = format!(
            "<header><h1>{}</h1>\n<p class=\"verdict\">{}</p></header>\n",
            escape(title),
            escape(verdict)
        );
        Self { title: title.to_owned(), body, in_section: false }
    }

    /// Begins a part of a report with several parts, with a title and a sentence. [`Page::jump`] links to its `id`.
    pub fn part(&mut self, id: &str, title: &str, verdict: &str) -> &mut Self {
        self.close();
        self.put(&format!(
            "<header class=\"part\" id=\"{}\"><h2>{}</h2>\n<p class=\"verdict\">{}</p></header>\n",
            escape(id),
            escape(title),
            escape(verdict)
        ))
    }

    /// Adds a link to a part further down.
    pub fn jump(&mut self, id: &str, words: &str) -> &mut Self {
        self.put(&format!("<p><a href=\"#{}\">{}</a></p>\n", escape(id), escape(words)))
    }

    /// Begins a section; `intro` may be empty.
    pub fn section(&mut self, heading: &str, intro: &str) -> &mut Self {
        self.close();
        self.in_section = true;
        self.put(&format!("<section><h2>{}</h2>\n", escape(heading)));
        if intro.is_empty() { self } else { self.text(intro) }
    }

    /// Adds a heading within the open section.
    pub fn heading(&mut self, heading: &str) -> &mut Self {
        self.put(&format!("<h2>{}</h2>\n", escape(heading)))
    }

    /// Adds a paragraph.
    pub fn text(&mut self, text: &str) -> &mut Self {
        self.put(&format!("<p>{}</p>\n", escape(text)))
    }

    /// Adds a block of code.
    pub fn code(&mut self, code: &str) -> &mut Self {
        self.put(&format!("<pre>{}</pre>\n", escape(code)))
    }

    /// Adds a list of notes; no element if there are none.
    pub fn list(&mut self, items: &[String]) -> &mut Self {
        if items.is_empty() {
            return self;
        }
        self.put("<ul>\n");
        for item in items {
            self.put(&format!("<li>{}</li>\n", escape(item)));
        }
        self.put("</ul>\n")
    }

    /// Adds short answers side by side, each under its question.
    pub fn facts(&mut self, facts: &[(&str, String)]) -> &mut Self {
        self.put("<dl class=\"facts\">\n");
        for (question, answer) in facts {
            let (question, answer) = (escape(question), escape(answer));
            self.put(&format!("<div><dt>{question}</dt><dd>{answer}</dd></div>\n"));
        }
        self.put("</dl>\n")
    }

    /// Adds a figure over the whole width.
    pub fn figure(&mut self, figure: &Figure, caption: &str) -> &mut Self {
        self.put("<figure>");
        if !figure.legend.is_empty() {
            self.put("<div class=\"legend\">");
            for (ink, name) in &figure.legend {
                let (class, name) = (ink.class(), escape(name));
                self.put(&format!("<span><i class=\"{class}\"></i>{name}</span>\n"));
            }
            self.put("</div>\n");
        }
        let live = figure.live.as_ref().filter(|_| figure.missing.is_none());
        match &figure.missing {
            Some(why) => self.put(&format!("<p class=\"missing\">{}</p>\n", escape(why))),
            None => self.put(&figure.svg()),
        };
        if let Some(json) = live {
            let json = embedded(json);
            self.put(&format!("<script type=\"application/json\">{json}</script>\n"));
        }
        self.put(&format!("<figcaption>{}</figcaption></figure>\n", escape(caption)))
    }

    /// Adds figures, side by side where there is room, and one above the other on a phone.
    pub fn figures(&mut self, figures: &[(Figure, String)]) -> &mut Self {
        self.put("<div class=\"side\">\n");
        for (figure, caption) in figures {
            self.figure(figure, caption);
        }
        self.put("</div>\n")
    }

    /// Adds a table, which scrolls in a frame if it is too wide.
    pub fn table(&mut self, table: &Table) -> &mut Self {
        let caption = escape(&table.caption);
        let cards = if table.head.len() >= CARDS { " class=\"cards\"" } else { "" };
        // the caption is outside of the frame, so that it does not scroll away
        self.put(&format!(
            "<p class=\"caption\">{caption}</p>\n\
             <div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"{caption}\">\
             <table{cards} aria-label=\"{caption}\">\n<thead><tr>"
        ));
        for head in &table.head {
            self.put(&format!("<th scope=\"col\">{}</th>", escape(head)));
        }
        self.put("</tr></thead>\n<tbody>\n");
        for (index, row) in table.rows.iter().enumerate() {
            let class = if table.highlight == Some(index) { " class=\"best\"" } else { "" };
            self.put(&format!("<tr{class}>"));
            for (column, cell) in row.iter().enumerate() {
                let cell = escape(cell);
                self.put(&match column {
                    0 => format!("<th scope=\"row\">{cell}</th>"),
                    _ => {
                        let head = escape(table.head.get(column).map_or("", String::as_str));
                        let class =
                            if cell.chars().count() > WORDS { " class=\"words\"" } else { "" };
                        format!("<td{class} data-head=\"{head}\">{cell}</td>")
                    }
                });
            }
            self.put("</tr>\n");
        }
        self.put("</tbody></table></div>\n")
    }

    /// Adds content that is folded behind a summary line.
    pub fn folded(&mut self, summary: &str, content: impl FnOnce(&mut Self)) -> &mut Self {
        self.put(&format!("<details><summary>{}</summary>\n", escape(summary)));
        content(self);
        self.put("</details>\n")
    }

    /// Returns the whole file, HTML that is also well-formed XML.
    pub fn finish(mut self) -> String {
        self.close();
        let title = escape(&self.title);
        let (body, script, policy) = (self.body, script::element(), script::policy());
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"/>\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n\
             <meta http-equiv=\"Content-Security-Policy\" content=\"{policy}\"/>\n\
             <meta name=\"color-scheme\" content=\"light dark\"/>\n\
             <title>{title}</title>\n<style>\n{STYLE}</style></head>\n<body><main>\n{body}\
             </main>\n{script}</body></html>\n"
        )
    }

    fn close(&mut self) {
        if std::mem::take(&mut self.in_section) {
            self.put("</section>\n");
        }
    }

    fn put(&mut self, html: &str) -> &mut Self {
        // writing to a string cannot fail
        let _ = self.body.write_str(html);
        self
    }
}
