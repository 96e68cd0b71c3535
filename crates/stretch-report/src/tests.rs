//! Properties of every report, for any data.

use std::sync::OnceLock;

use stretch_calibrate::{
    Calibrated, Candidate, Evaluation, MethodErrors, ModelKind, Options, TrialErrors, calibrate,
    evaluate,
};
use stretch_core::Degree;
use stretch_data::{Channel, Trial};

use testkit::page::without_program;

use super::{
    Context, Judged, calibration_page,
    canvas::Ink,
    figure::{Axes, Figure, FigureSize, plot},
    gauges_report,
    markup::{escape, fixed, number, tick},
    page::{Page, Table},
    readme_picture, thin,
};

/// A gauge with a lag and a bend, on a joint that moves to and fro.
fn recording(name: &str, speed: f64, samples: usize) -> Trial {
    let time_s: Vec<f64> = (0..samples).map(|n| n as f64 * 0.01).collect();
    let angle = |t: f64| 40.0 - 30.0 * (speed * t).cos() - 10.0 * (2.3 * speed * t).cos();
    let gauge = |t: f64| 0.1 + 0.01 * angle(t - 0.06) + 4e-5 * angle(t).powi(2);
    let channel = |name: &str, values| Channel { name: name.into(), values };
    let angle_deg = time_s.iter().map(|&t| angle(t)).collect();
    let signal = time_s.iter().map(|&t| gauge(t)).collect();
    let channels = vec![channel("angle_deg", angle_deg), channel("gauge", signal)];
    Trial { name: name.into(), time_s, channels }
}

struct Made {
    linear: Calibrated,
    poly13: Calibrated,
    evaluation: Evaluation,
}

impl Made {
    /// Returns calibrations that were judged on one recording, for most tests.
    fn on_tuesday() -> &'static Self {
        static MADE: OnceLock<Made> = OnceLock::new();
        MADE.get_or_init(|| Self::new(&[recording("tuesday", 1.3, 3000)]))
    }

    fn new(tests: &[Trial]) -> Self {
        let fit = [recording("monday", 1.1, 4000)];
        let options = Options {
            signal: "gauge".into(),
            reference: "angle_deg".into(),
            model: ModelKind::Surface(Degree::POLY13),
            ..Options::default()
        };
        let poly13 = calibrate(&fit, &options).unwrap();
        let linear = calibrate(&fit, &Options { model: ModelKind::Linear, ..options }).unwrap();
        let named = [("linear", &linear.calibration), ("poly13", &poly13.calibration)];
        let evaluation = evaluate(&named, tests).unwrap();
        Self { linear, poly13, evaluation }
    }

    fn page(&self, context: &Context) -> String {
        let calibrated = self.calibrated();
        calibration_page(&Judged { calibrated: &calibrated, evaluation: &self.evaluation, context })
    }

    fn calibrated(&self) -> [(&str, &Calibrated); 2] {
        [("linear", &self.linear), ("poly13", &self.poly13)]
    }
}

fn context(tested_on: &str) -> Context {
    let candidate = |signal: &str, rmse, problem: Option<&str>| Candidate {
        signal: signal.into(),
        cross_validated_rmse: rmse,
        problem: problem.map(Into::into),
    };
    Context {
        title: "A joint & its gauge".into(),
        calibrated_on: vec!["monday".into()],
        tested_on: vec![tested_on.into()],
        signal_choice: vec![
            candidate("gauge", Some(0.01), None),
            candidate("other", None, Some("constant")),
        ],
        notes: vec!["resampled <twice>".into()],
        kinds: Vec::new(),
    }
}

/// Checks that tags nest, attributes are quoted and once each, and text holds no bare `<` or `&`.
/// Returns the names of all elements.
fn elements(document: &str) -> Vec<String> {
    let document = &without_program(document);
    let text = document.strip_prefix("<!DOCTYPE html>\n").unwrap_or(document);
    let (mut open, mut all) = (Vec::<String>::new(), Vec::new());
    for piece in text.split('<').skip(1) {
        let (tag, words) = piece.split_once('>').expect("a tag ends");
        assert!(!words.contains('>'), "bare > in {words:?}");
        let in_style = open.last().is_some_and(|name| name == "style") || tag == "style";
        for entity in words.split('&').skip(1).filter(|_| !in_style) {
            let known = ["amp;", "lt;", "gt;", "quot;", "#39;"];
            assert!(known.iter().any(|k| entity.starts_with(k)), "bare & in {words:?}");
        }
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop().as_deref(), Some(name));
            continue;
        }
        let (tag, closed) = tag.strip_suffix('/').map_or((tag, false), |tag| (tag, true));
        let (name, attributes) = tag.split_once(' ').unwrap_or((tag, ""));
        let mut rest = attributes.trim();
        let mut seen = Vec::new();
        while !rest.is_empty() {
            let (key, value) = rest.split_once("=\"").expect("name=\"value\"");
            let (_, after) = value.split_once('"').expect("a quote ends");
            assert!(!seen.contains(&key), "{key} twice in {tag}");
            seen.push(key);
            rest = after.trim_start();
        }
        if name == "svg" {
            assert!(seen.contains(&"aria-label") && seen.contains(&"viewBox"));
        }
        all.push(name.to_owned());
        if !closed {
            open.push(name.to_owned());
        }
    }
    assert_eq!(open, Vec::<String>::new(), "not closed");
    all
}

/// Checks that no number on the page or in a path is NaN.
fn assert_numbers(page: &str) {
    let page = &without_program(page);
    for bad in ["NaN", "inf ", "inf\"", "inf<", "-inf", "2147483647", "-2147483648"] {
        let at = page.find(bad).map(|i| &page[i.saturating_sub(80)..(i + 20).min(page.len())]);
        assert!(at.is_none(), "{bad} in {at:?}");
    }
}

#[test]
fn a_page_is_one_well_formed_file_with_every_figure() {
    let made = Made::on_tuesday();
    let page = made.page(&context("tuesday"));
    let all = elements(&page);
    let count = |name: &str| all.iter().filter(|e| *e == name).count();
    // two time plots, signal against reference, two plots of errors, two surfaces, two cuts
    assert_eq!(count("figure"), 9);
    // three of the figures have two drawings, one for phones and one for desktops
    assert_eq!(count("svg"), 12);
    assert!(!page.contains("class=\"missing\""));
    // tables of methods, comparisons and signals; of the coefficients of three fits; and of the orders of two fits
    assert_eq!(count("table"), 8);
    assert_numbers(&page);
}

#[test]
fn a_page_needs_no_network_and_runs_its_own_script_alone() {
    let page = Made::on_tuesday().page(&context("tuesday"));
    let page = without_program(&page);
    for reach in ["http:", "https:", "//", "url(", "@import", "<link", "src=", "href="] {
        assert!(!page.contains(reach), "{reach}");
    }
    // only the page's script and data, and a policy that allows this script and nothing else
    let scripts = page.matches("<script").count();
    assert_eq!(page.matches("<script type=\"application/json\">").count() + 1, scripts);
    assert!(page.contains("default-src 'none'; script-src 'sha256-"));
}

#[test]
fn inline_figures_take_their_colours_from_the_page() {
    let page = Made::on_tuesday().page(&context("tuesday"));
    let page = without_program(&page);
    let (_, body) = page.split_once("</head>").unwrap();
    assert!(body.contains("class=\"line ink-3\""));
    assert!(!body.contains("fill=\"") && !body.contains("stroke=\"") && !body.contains("style="));
}

#[test]
fn names_cannot_become_markup() {
    let name = "<script>alert(\"1\")</script> & 'more'";
    let made = Made::new(&[recording(name, 1.3, 3000)]);
    let page = made.page(&context(name));
    elements(&page);
    assert!(!page.contains("<script>alert"));
    assert!(page.contains("\\u003cscript\\u003ealert"), "the data tell names without markup");
    assert!(page.contains("&lt;script&gt;alert(&quot;1&quot;)"));
    assert!(page.contains("A joint &amp; its gauge"));
    elements(&readme_picture(&made.calibrated(), &made.evaluation));
}

#[test]
fn the_first_sentence_says_what_the_numbers_say() {
    let sentence = |page: &str| {
        let (_, rest) = page.split_once("<p class=\"verdict\">").unwrap();
        rest.split_once("</p>").unwrap().0.to_owned()
    };
    let made = Made::on_tuesday();
    let [raw, linear, poly13] = &made.evaluation.pooled[..] else { unreachable!() };
    assert!(poly13.rmse < linear.rmse);
    let deg = |m: &MethodErrors| format!("{}\u{a0}deg", number(m.rmse, 3));
    assert_eq!(
        sentence(&made.page(&context("tuesday"))),
        format!(
            "On a recording that was not used for the fit, poly13 is off by {} (RMSE, {}\u{a0}% of the range); the raw signal, \
             scaled to the reference, by {}.",
            deg(poly13),
            number(poly13.rmse_percent, 2),
            deg(raw)
        )
    );
    // a page about the data of the fit states this, whatever the caller claims
    let same = Made::new(&[recording("monday", 1.1, 4000)])
        .page(&Context { tested_on: Vec::new(), ..context("") });
    assert!(sentence(&same).starts_with("On the same recordings as the fit"));
    assert!(same.contains("which flatters every method"));
}

#[test]
fn a_picture_stands_before_the_first_table() {
    let made = Made::on_tuesday();
    let html = made.page(&context("tuesday"));
    let [picture, table] = ["<figure>", "<table"].map(|element| html.find(element).unwrap());
    assert!(picture < table);
}

#[test]
fn data_without_a_number_give_notes_and_no_panic() {
    let nan = MethodErrors {
        method: "raw".into(),
        samples: 0,
        withheld: 9,
        clamped: 0,
        rmse: f64::NAN,
        rmse_percent: f64::NAN,
        average_error_percent: f64::INFINITY,
        average_error_percent_of_reference: f64::NAN,
        signed_error_percent: f64::NAN,
        bias: f64::NAN,
        mae: f64::NAN,
        max: f64::NEG_INFINITY,
        r_squared: f64::NAN,
        lag_s: None,
    };
    let methods = vec![nan.clone(), MethodErrors { method: "linear".into(), ..nan }];
    let trial = |samples: usize, value: f64| TrialErrors {
        trial: "void".into(),
        methods: methods.clone(),
        time_s: (0..samples).map(|n| n as f64 * 0.01).collect(),
        signal: vec![value; samples],
        reference: vec![value; samples],
        estimates: vec![vec![value; samples]; 2],
        rates: vec![vec![f64::NAN; samples]; 2],
    };
    let cases = [
        vec![],
        vec![trial(0, 0.0)],
        vec![trial(1, 1.0)],
        vec![trial(2000, f64::NAN)],
        vec![trial(2000, f64::INFINITY)],
        vec![trial(2000, 3.0)],
        vec![trial(2000, 1e300), trial(2000, -1e300)],
    ];
    for trials in cases {
        // a rate needs eleven samples
        let nothing = |t: &TrialErrors| t.reference.iter().filter(|x| x.is_finite()).count() < 11;
        let notes = trials.iter().all(nothing);
        let (comparisons, unit) = (Vec::new(), String::new());
        let evaluation = Evaluation { unit, trials, pooled: methods.clone(), comparisons };
        let context = Context::default();
        let judged = Judged { calibrated: &[], evaluation: &evaluation, context: &context };
        let page = calibration_page(&judged);
        elements(&page);
        assert_numbers(&page);
        assert!(page.contains("No estimate could be compared with a reference."));
        assert_eq!(page.contains("There is no error to draw"), notes);
        let picture = readme_picture(&[], &evaluation);
        assert!(picture.is_empty() || !elements(&picture).is_empty());
    }
}

#[test]
fn a_large_evaluation_stays_a_small_file() {
    let tests: Vec<_> =
        (0..6).map(|i| recording(&format!("t{i}"), 1.1 + 0.1 * f64::from(i), 12_000)).collect();
    let made = Made::new(&tests);
    let page = made.page(&context("t0"));
    assert!(page.len() < 1_500_000, "{} bytes", page.len());
    assert!(page.contains("2 more recordings are in the tables only."));
    elements(&page);
}

#[test]
fn a_picture_stands_alone() {
    let made = Made::on_tuesday();
    let svg = readme_picture(&made.calibrated(), &made.evaluation);
    elements(&svg);
    assert_eq!(svg.matches("http").count(), 1, "the namespace alone");
    assert!(svg.contains("xmlns=\"http://www.w3.org/2000/svg\""));
    assert!(svg.contains(">reference</text>") && svg.contains(">non-linear (poly13)</text>"));
    assert!(!svg.contains("var(--page)"));
}

/// Relative luminance of `#rrggbb` (WCAG 2.2).
fn luminance(hex: &str) -> f64 {
    let part = |i: usize| f64::from(u8::from_str_radix(&hex[i..i + 2], 16).unwrap()) / 255.0;
    let linear = |c: f64| if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) };
    0.2126 * linear(part(1)) + 0.7152 * linear(part(3)) + 0.0722 * linear(part(5))
}

#[test]
fn colours_stand_out_from_the_page_in_light_and_dark() {
    let style = include_str!("style.css");
    let blocks: Vec<&str> = style.split(":root {").skip(1).collect();
    assert_eq!(blocks.len(), 2);
    for block in blocks {
        let color = |name: &str| {
            let (_, rest) = block.split_once(&format!("--{name}: ")).expect(name);
            luminance(&rest[..7])
        };
        let contrast = |a: f64, b: f64| (a.max(b) + 0.05) / (a.min(b) + 0.05);
        let against = |name: &str| contrast(color(name), color("page"));
        // WCAG 2.2: 4.5 for words (1.4.3), 3 for lines that mean something (1.4.11)
        for words in ["text", "soft"] {
            assert!(against(words) >= 4.5 && contrast(color(words), color("card")) >= 4.5);
        }
        let lines =
            ["axis", "truth", "one", "two", "three", "four", "five", "low", "middle", "high"];
        for line in lines {
            assert!(against(line) >= 3.0, "{line}: {}", against(line));
        }
    }
}

#[test]
fn every_ink_has_a_colour_on_the_page_and_in_a_picture() {
    let inks = [
        Ink::Text,
        Ink::Axis,
        Ink::Grid,
        Ink::Truth,
        Ink::First,
        Ink::Second,
        Ink::Third,
        Ink::Fourth,
        Ink::Fifth,
        Ink::Low,
        Ink::Middle,
        Ink::High,
    ];
    for ink in inks {
        let rule = format!(".{} {{ --c: ", ink.class());
        assert!(include_str!("style.css").contains(&rule), "{rule}");
        assert!(include_str!("figure_light.css").contains(&rule), "{rule}");
    }
    assert_eq!(Ink::of(5), Ink::First);
}

#[test]
fn the_frame_serves_other_reports() {
    let axes = Axes {
        x: 1.0..1.0,
        y: f64::NAN..2.0,
        x_label: "x".into(),
        y_label: "a < b".into(),
        is_log: false,
    };
    let figure = Figure::new("an empty figure")
        .draw(FigureSize::NARROW, |area| plot(area, &axes, |_| Ok(())))
        .legend([(Ink::Second, "nothing".to_owned())]);
    let mut page = Page::new("t", "v");
    page.section("one", "").figure(&figure, "c").figure(&Figure::missing("no data"), "d");
    page.section("two", "intro").table(&Table {
        caption: "cap".into(),
        head: vec!["a".into(), "b".into()],
        rows: vec![vec!["r".into(), "1".into()]],
        highlight: Some(0),
    });
    page.folded("more", |page| {
        page.list(&["x".into()]).list(&[]).text("y");
    });
    let html = page.finish();
    let all = elements(&html);
    assert_eq!(all.iter().filter(|e| *e == "section").count(), 2);
    assert!(html.contains("no data") && html.contains("a &lt; b"));
    assert_numbers(&html);
}

#[test]
fn a_thinned_curve_keeps_its_peaks_and_its_holes() {
    let time: Vec<f64> = (0..10_000).map(|n| n as f64 * 0.01).collect();
    let mut values: Vec<f64> = time.iter().map(|t| t.sin()).collect();
    values[3_333] = 7.0;
    values[6_000..6_200].fill(f64::NAN);
    let pieces = thin::curve(&time, &values, &(0.0..100.0), 200);
    assert_eq!(pieces.len(), 2);
    let points: Vec<_> = pieces.concat();
    assert!(points.len() <= 400 + 4);
    assert!(points.contains(&(time[3_333], 7.0)));
    assert!(points.windows(2).all(|w| w[0].0 < w[1].0));
    assert!(points.iter().all(|(t, _)| !(time[6_000]..time[6_200]).contains(t)));
    // a jump in time also interrupts the curve
    let leap = [0.0, 0.01, 0.02, 9.0, 9.01, 9.02].map(|t: f64| t);
    let dense: Vec<f64> = (0..400).map(|n| n as f64 * 0.01).chain(leap.map(|t| t + 50.0)).collect();
    assert_eq!(thin::curve(&dense, &vec![1.0; dense.len()], &(0.0..60.0), 50).len(), 3);
}

#[test]
fn bins_hold_medians_and_samples_cover_all() {
    let points: Vec<(f64, f64)> =
        (0..1000).map(|n| (f64::from(n) / 1000.0, f64::from(n % 10))).collect();
    let bins = thin::binned(&points, &(0.0..1.0), 4);
    assert_eq!(bins.len(), 4);
    assert!(bins.iter().all(|b| b.low <= b.median && b.median <= b.high));
    assert_eq!(bins[0].x, 0.125);
    let some = thin::sample(&points, 100);
    assert_eq!(some.len(), 100);
    let tenth = |k: usize| some.iter().filter(|(x, _)| (x * 10.0) as usize == k).count();
    assert!((0..10).all(|k| (8..=12).contains(&tenth(k))));
    assert_eq!(thin::sample(&points[..5], 100), &points[..5]);
    assert_eq!(thin::extent([f64::NAN, f64::INFINITY]), None);
    assert!(thin::quantile(&[], 0.5).is_nan());
}

#[test]
fn numbers_read_as_written() {
    assert_eq!(number(5.951, 3), "5.95");
    assert_eq!(number(-0.012345, 2), "\u{2212}0.012");
    assert_eq!(number(1234.6, 2), "1235");
    assert_eq!(number(2e-9, 2), "2.0e\u{2212}9");
    assert_eq!(number(f64::NAN, 2), "\u{2013}");
    assert_eq!(fixed(-0.0001, 2), "0.00");
    assert_eq!(tick(0.30000000000000004, 1.0), "0.3");
    assert_eq!(tick(150.0, 30.0), "150");
    assert_eq!(tick(0.0, 0.004), "0");
    assert_eq!(escape("a\u{0}b\"'"), "a\u{fffd}b&quot;&#39;");
}

#[test]
fn a_part_closes_what_stands_before_it() {
    let mut page = Page::new("Whole", "One.");
    page.section("A", "").part("second", "Second", "Two & three.").section("B", "");
    let names = elements(&page.finish());
    let count = |name: &str| names.iter().filter(|n| *n == name).count();
    assert_eq!(["h1", "h2", "header", "section"].map(count), [1, 3, 2, 2]);
}

#[test]
fn a_logarithmic_axis_bears_the_numbers_it_stands_for() {
    let axes = Axes {
        x: -1.75..1.15,
        y: 0.0..1.0,
        x_label: "frequency, Hz".into(),
        y_label: "gain".into(),
        is_log: true,
    };
    let figure =
        Figure::new("a gain").draw(FigureSize::NARROW, |area| plot(area, &axes, |_| Ok(())));
    let svg = figure.svg();
    for number in [">0.1<", ">1<", ">10<"] {
        assert!(svg.contains(number), "{number} in {svg}");
    }
    assert!(!svg.contains(">\u{2212}1<"));
}

#[test]
fn rows_of_a_wide_table_carry_their_heads_to_a_phone() {
    let mut page = Page::new("t", "v");
    page.table(&Table {
        caption: "wide".into(),
        head: ["a", "b", "c", "<d>"].map(str::to_owned).to_vec(),
        rows: vec![
            ["r", "1", "2", "a cell of words that is longer than a number"]
                .map(str::to_owned)
                .to_vec(),
        ],
        highlight: None,
    });
    let html = page.finish();
    elements(&html);
    assert!(html.contains("<table class=\"cards\""));
    assert!(html.contains("<td class=\"words\" data-head=\"&lt;d&gt;\">a cell of words"));
}

/// Nothing and unknown are always listed, the most probable answer comes first, and sets below 0.5 % are counted.
#[test]
fn every_probable_answer_has_its_row() {
    let value = stretch_gap::EffectValue {
        effect: "a".into(),
        name: "c".into(),
        unit: "1".into(),
        value: 0.6,
        sd: 0.1,
        interval: [0.4, 0.6],
        is_form: false,
        at_bound: true,
    };
    let candidate = |effects: &[&str], probability: f64| stretch_gap::Candidate {
        effects: effects.iter().map(|e| (*e).to_owned()).collect(),
        probability,
        score: 1.0,
        gap_before: 3.0,
        gap_after: 0.0,
        left: 0.0,
        at_bound: false,
        closed: 1.0,
        closed_ci: [1.0, 1.0],
        is_confirmed: true,
        by_name: Default::default(),
        parameters: effects.iter().filter(|e| **e != "unknown").map(|_| value.clone()).collect(),
    };
    let mut all = vec![candidate(&["a", "b"], 0.144), candidate(&["a"], 0.239)];
    all.extend((0..7).map(|_| candidate(&["b"], 0.001)));
    all.extend([candidate(&[], 0.002), candidate(&["unknown"], 0.608)]);
    let table = crate::candidate_table(&all);
    let firsts: Vec<&str> = table.rows.iter().map(|row| row[0].as_str()).collect();
    assert_eq!(firsts, ["unknown", "a", "a + b", "none"]);
    assert_eq!((table.rows[0][1].as_str(), table.highlight), ("0.608", Some(0)));
    assert!(table.caption.ends_with("; 7 others are below 0.5 %"), "{}", table.caption);
    // sets have the numbers of their rows, and a strength at the end of its range is marked
    let numbers = crate::candidate_numbers_table(&all, &[]);
    assert_eq!([&numbers.rows[0][0], &numbers.rows[0][1]], ["a", "2"]);
    assert!(numbers.rows[0][3].contains("(at the end of its range)"), "{:?}", numbers.rows[0]);
}

/// Weights and readings without a time have no lag, no course over time and no rates.
#[test]
fn a_table_of_weights_is_not_drawn_over_time() {
    let samples = recording("weights.csv", 1.3, 60);
    let time_s = (0..60).map(f64::from).collect();
    let rows = Trial { time_s, ..samples };
    let options = Options {
        signal: "gauge".into(),
        reference: "angle_deg".into(),
        model: ModelKind::Linear,
        is_table: true,
        ..Options::default()
    };
    let linear = calibrate(std::slice::from_ref(&rows), &options).unwrap();
    let evaluation = evaluate(&[("linear", &linear.calibration)], &[rows]).unwrap();
    assert!(evaluation.pooled.iter().all(|errors| errors.lag_s.is_none()));
    let context = Context::default();
    let calibrated = &[("linear", &linear)];
    let page = calibration_page(&Judged { calibrated, evaluation: &evaluation, context: &context });
    for absent in
        ["Estimate and reference over time", "Error over the rate", "half-second", "eight seconds"]
    {
        assert!(!page.contains(absent), "{absent}");
    }
    assert!(page.contains("Signal and reference") && page.contains("Error over the reference"));
}

/// The page of several gauges has a part for each, with the sections of every calibration.
#[test]
fn a_page_of_several_gauges_has_a_part_for_each() {
    let made = Made::on_tuesday();
    let context =
        Context { title: "Calibration of angle_deg on s1, s2".into(), ..Context::default() };
    let gauges = ["s1", "s2"].map(|name| (name, &made.linear, &made.evaluation));
    let page = gauges_report(&made.evaluation, &gauges, &context);
    assert!(page.contains("the calibration of all gauges is off by"));
    for name in ["s1", "s2"] {
        assert!(
            page.contains(&format!("<h2>{name} alone</h2>")) && page.contains(&format!("#{name}"))
        );
    }
    assert_eq!(page.matches("<h2>Signal and reference</h2>").count(), 2);
    assert_eq!(page.matches("<h2>How good it is</h2>").count(), 3);
    assert_eq!(page.matches("<h2>What was fitted</h2>").count(), 2);
}
