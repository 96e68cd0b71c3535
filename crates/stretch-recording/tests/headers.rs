//! Where a table begins and what its columns are named, for files as loggers and instruments write
//! them.

use stretch_recording::{DateOrder, ReadOptions, Recording, RowReader};

/// Returns 40 rows of numbers at 50 Hz with a separator. `end` follows the last number of each row.
fn rows(separator: &str, end: &str) -> String {
    let row = |i: u32| {
        let t = 0.02 * f64::from(i);
        let cells = [format!("{t:.3}"), format!("{:.3}", 100.0 + t), format!("{:.3}", 1.0 + t)];
        format!("{}{end}\n", cells.join(separator))
    };
    (0..40).map(row).collect()
}

/// Returns the names of the channels that are read, and the notes.
#[track_caller]
fn names(text: &str, options: &ReadOptions) -> (String, Vec<String>) {
    let read = Recording::from_reader(text.as_bytes(), "t.txt", options);
    let Recording { trial, notes } = read.unwrap_or_else(|e| panic!("{text:.300}: {e}"));
    assert_eq!(trial.len(), 40, "{text:.300}: {notes:?}");
    let rate_hz = trial.rate_hz().expect("a rate");
    assert!((rate_hz - 50.0).abs() < 1e-6, "{rate_hz} Hz: {notes:?}");
    let names: Vec<&str> = trial.channels.iter().map(|c| c.name.as_str()).collect();
    (names.join(" "), notes)
}

#[track_caller]
fn fails(text: &str, options: &ReadOptions, parts: &[&str]) {
    let error = Recording::from_reader(text.as_bytes(), "t.txt", options).expect_err("refused");
    let error = error.to_string();
    for part in parts {
        assert!(error.contains(part), "{part}: {error}");
    }
}

#[test]
fn the_header_is_directly_above_the_numbers() {
    let semicolons = rows(";", "");
    let commas = rows(",", "");
    for (text, expected) in [
        // names, then units, with or without a separator at the end of each line
        (format!("Time;Pos;U;\ns;mm;V;\n{semicolons}"), "pos_mm u_v"),
        (format!("Time;Pos;U\n(s);(mm);(V)\n{}", rows(";", ";")), "pos_mm u_v"),
        (format!("\"sep=;\"\nTime;Pos;U\ns;mm;V\n{semicolons}"), "pos_mm u_v"),
        // results above the raw data, in the same and in other numbers of columns
        (
            format!(
                "Results\n,\"Load\",\"E\"\n,\"(N)\",\"(MPa)\"\n1,\"12.3\",\"1.2\"\n\nRaw data\n\"Time\",\"Pos\",\"F\"\n\"(s)\",\"(mm)\",\"(N)\"\n{commas}"
            ),
            "pos_mm f_n",
        ),
        (
            format!(
                "Specimen,Width,Thickness\n1,12.1,1.2\n2,12.2,1.2\n3,12.0,1.1\nMean,12.1,1.2\nTime,Pos,F\ns,mm,N\n{commas}"
            ),
            "pos_mm f_n",
        ),
        (format!("Sample rate,50\nOperator,A. Smith\nt,a,b\n{commas}"), "a b"),
        // a line of dashes or of text below the names
        (format!("t;a;b\n------\n{semicolons}"), "a b"),
        (format!("t;a;b\nraw;filtered;\n{semicolons}"), "a b"),
        // labels before the names
        (
            format!(
                "Interval=\t0.02 s\nChannelTitle=\tForce\tPos\nRange=\t10 V\t10 V\n{}",
                rows("\t", "")
            ),
            "Force Pos",
        ),
        (
            format!(
                "Interval=\t0.02 s\nChannelTitle=\tForce\tPos\nUnitName=\tN\tmm\nRange=\t10 V\t5 V\n{}",
                rows("\t", "")
            ),
            "force_n pos_mm",
        ),
        // lines with numbers above the names
        (
            format!(
                "LabVIEW Measurement\t\nChannels\t2\t\t\nSamples\t60\t60\t\nX_Dimension\tTime\tTime\t\nX0\t0,0\t0,0\t\nDelta_X\t0,02\t0,02\t\n***End_of_Header***\t\t\t\nX_Value\ta\tb\tComment\n{}",
                rows("\t", "").replace('.', ",")
            ),
            "a b",
        ),
        // more names than numbers: the surplus names are remarks
        (format!("X_Value\ta\tb\tComment\n{}", rows("\t", "")), "a b"),
        // names in a comment
        (format!("Frame Count 3\n# exported\n# time_s a b\n{}", rows(" ", "")), "a b"),
    ] {
        assert_eq!(names(&text, &ReadOptions::new()).0, expected, "{text:.200}");
        let mut live = RowReader::new(text.as_bytes(), "t.txt", &ReadOptions::new()).expect("live");
        let first = live.next_row().expect("a row").expect("sound");
        assert_eq!(first.time_s, 0.0, "{text:.200}");
    }
}

#[test]
fn the_unit_of_the_time_stands_below_it() {
    let in_ms: String =
        (0..40).map(|i| format!("{},{i},1,\n", 1_700_000_000_000_u64 + 20 * i)).collect();
    let text = format!(
        "\"sep=,\"\nUnit_A_Timestamp_CAL,Unit_A_Length_CAL,Unit_A_Gauge_CAL\nms,mm,mV\n{in_ms}"
    );
    let (read, notes) = names(&text, &ReadOptions::new());
    assert_eq!(read, "unit_a_length_cal_mm unit_a_gauge_cal_mv");
    assert!(notes.contains(&"the time is column unit_a_timestamp_cal_ms".to_owned()), "{notes:?}");
    // The number of names may differ from the header if it matches the rows.
    let given = ReadOptions::new().columns(["t_ms", "length_mm", "gauge_mv"]);
    assert_eq!(names(&text, &given).0, "length_mm gauge_mv");
}

#[test]
fn a_rate_above_the_table_is_taken_where_there_is_no_time() {
    let scope: String = (0..40).map(|i| format!("{i},1.{i:02},2,\n")).collect();
    let scope = format!(
        "X,CH1,CH2,Start,Increment,\nSequence,Volt,Volt,0.000000e+00,2.000000e-02\n{scope}"
    );
    let (read, notes) = names(&scope, &ReadOptions::new());
    assert_eq!(read, "x ch1_v ch2_v");
    assert!(notes.contains(
        &"there is no time column: the time is computed from a rate of 50 Hz, as given by Increment above the table".to_owned()
    ));
    // A rate in the options replaces the rate in the file.
    let Recording { trial, .. } =
        Recording::from_reader(scope.as_bytes(), "t", &ReadOptions::new().sample_rate_hz(10.0))
            .expect("read");
    assert!((trial.rate_hz().expect("a rate") - 10.0).abs() < 1e-9);
    let values: String = (0..40).map(|i| format!("{i};1\n")).collect();
    for above in
        ["Sample rate;50", "Sampling rate: 50 Hz", "Interval (ms);20", "dt=0,02 s", "Delta_X;0,02"]
    {
        assert_eq!(
            names(&format!("{above}\na;b\n{values}"), &ReadOptions::new()).0,
            "a b",
            "{above}"
        );
    }
    for above in ["Sample rate;fast", "Rate;50", "Interval;0", ""] {
        fails(
            &format!("{above}\na;b\n{values}"),
            &ReadOptions::new(),
            &["no column time_s", "--time"],
        );
    }
}

#[test]
fn without_names_it_is_said_what_was_found() {
    let text = format!("Log of Monday\n\nOperator: A\n{}", rows(",", ""));
    fails(
        &text,
        &ReadOptions::new(),
        &["t.txt: 40 rows of 3 numbers from line 4 on", "(\"Operator: A\";", "--columns"],
    );
    let long = rows(",", "").repeat(10);
    fails(
        &long,
        &ReadOptions::new(),
        &["at least 256 rows of 3 numbers from line 1 on, and no names above them"],
    );
    fails("a;b\nc;d\n", &ReadOptions::new(), &["none of its first 2 lines is a row of numbers"]);
    fails("# nothing yet\n", &ReadOptions::new(), &["its first line is not a row of numbers"]);
    let one = (0..300).map(|n| format!("{n}\n")).collect::<String>();
    fails(&format!("gauge_mv\n{one}"), &ReadOptions::new(), &["one number only", "--time 100hz"]);
    fails("\n \n", &ReadOptions::new(), &["the file is empty"]);
    let four = ReadOptions::new().columns(["time_s", "a", "b", "c"]);
    fails(&rows(",", ""), &four, &["row 1: the row has 3 numbers, but --columns names 4"]);
}

#[test]
fn text_before_the_numbers_is_named_as_well() {
    let tagged: String = (0..40).map(|i| format!("$DATA,{},1.{i:02},2\n", 20 * i)).collect();
    let given =
        ReadOptions::new().columns(["tag", "time_ms", "pos_mm", "volt_v"]).require("volt_v");
    assert_eq!(names(&tagged, &given).0, "pos_mm volt_v");
    assert_eq!(names(&format!("ATA,0,1.0\n{tagged}"), &given).0, "pos_mm volt_v");
    let named = format!("tag,time_ms,pos_mm,volt_v\n{tagged}");
    assert_eq!(names(&named, &ReadOptions::new()).0, "pos_mm volt_v");
}

#[test]
fn a_serial_monitor_puts_a_time_of_day_before_each_line() {
    let stamp = |i: u32| format!("10:00:{:02}.{:03} -> ", i / 50, 20 * (i % 50));
    let lines: String = (0..40).map(|i| format!("{}101.{i:02},1.02\n", stamp(i))).collect();
    let given = ReadOptions::new().columns(["time", "pos_mm", "volt_v"]);
    assert_eq!(names(&lines, &given).0, "pos_mm volt_v");
    let commas: String = (0..40).map(|i| format!("{}101,{i:02}; 1,02\n", stamp(i))).collect();
    assert_eq!(names(&commas, &given).0, "pos_mm volt_v");
    // names from the board, with and without a time among them
    let named = format!("{}pos_mm,volt_v\n{lines}", stamp(0));
    assert_eq!(names(&named, &ReadOptions::new()).0, "pos_mm volt_v");
}

#[test]
fn the_time_goes_by_many_names() {
    for time in [
        "Time (Seconds)",
        "time (SEC)",
        "Tiempo (segundos)",
        "Temps (s)",
        "Prüfzeit (s)",
        "Time since start (s)",
        "time_seconds",
        "rel_time",
        "Time [S]",
        "elapsed (sec)",
        "Zeit / s",
        "System Time",
        "X_Value",
        "t",
    ] {
        let text = format!("{time};a;b\n{}", rows(";", ""));
        assert_eq!(names(&text, &ReadOptions::new()).0, "a b", "{time}");
    }
    let in_ms: String = (0..40).map(|i| format!("{};1\n", 20 * i)).collect();
    for time in ["elapsed_ms", "Millis", "time [Millis]", "Time (milliseconds)", "rel_time (ms)"] {
        assert_eq!(names(&format!("{time};a\n{in_ms}"), &ReadOptions::new()).0, "a", "{time}");
    }
    // two columns that may be the time, without a usual name
    let two = format!("rise_time_s;fall_time_s;b\n{}", rows(";", ""));
    fails(
        &two,
        &ReadOptions::new(),
        &["no column time_s", "--time COLUMN", "rise_time_s, fall_time_s"],
    );
}

#[test]
fn names_of_one_kind_are_numbered_and_only_what_is_asked_for_must_be_one() {
    let text = format!("time_s,X,X\n{}", rows(",", ""));
    let (read, notes) = names(&text, &ReadOptions::new());
    assert_eq!(read, "X X.1");
    assert_eq!(notes, ["columns with the same name are numbered: X (column 3) -> X.1"]);
    assert_eq!(names(&text, &ReadOptions::new().require("X.1")).0, "X X.1");
    assert_eq!(names(&text, &ReadOptions::new().require("X.0")).0, "X.0 X.1");
    fails(&text, &ReadOptions::new().require("X"), &["names column X twice", "X.0 or X.1"]);
    // If several columns have the name of the time, the first is the time.
    let twice = format!("Time (s),a,Time (s)\n{}", rows(",", ""));
    assert_eq!(names(&twice, &ReadOptions::new()).0, "a time_s.1");
    let stray: String =
        (0..40).map(|i| format!("100,{:.2},{i},,,,\n", 0.02 * f64::from(i))).collect();
    let stray = format!("RPM,time,count,,,0.02,0.02\n{stray}");
    assert_eq!(names(&stray, &ReadOptions::new().require("RPM")).0, "RPM count");
    let markers =
        format!("Frame,X,Y,Z,X,Y,Z\n,mm,mm,mm,mm,mm,mm\n{}", "1,2,3,4,5,6,7\n".repeat(40));
    let read = names(&markers, &ReadOptions::new().sample_rate_hz(50.0)).0;
    assert_eq!(read, "Frame x_mm y_mm z_mm x_mm.1 y_mm.1 z_mm.1");
}

#[test]
fn an_index_is_no_unit() {
    let text = format!("t,q[0],q[1]\n{}", rows(",", ""));
    assert_eq!(
        names(&text, &ReadOptions::new()),
        ("q[0] q[1]".to_owned(), vec!["the time is column t".to_owned()])
    );
    let text = format!("t,trial (1),ratio [-]\n{}", rows(",", ""));
    assert_eq!(names(&text, &ReadOptions::new()).0, "trial (1) ratio");
}

#[test]
fn text_that_is_no_utf_8_is_read_as_windows_1252() {
    let text = format!("Zeit (s);L\u{e4}nge (mm);\u{80} [\u{b0}]\n{}", rows(";", ""));
    let bytes: Vec<u8> = text.chars().map(|c| c as u8).collect();
    let Recording { trial, notes } =
        Recording::from_reader(&bytes[..], "t.csv", &ReadOptions::new().require("länge_mm"))
            .expect("read");
    assert_eq!(trial.len(), 40);
    assert_eq!(notes[0], "the column names are not UTF-8 and are read as Windows-1252");
    assert!(notes[1].contains("€ [°]") || trial.channels[1].name.contains('€'), "{notes:?}");
}

#[test]
fn dates_are_read_in_the_order_that_they_show() {
    let dated = |date: &str, end: &str| -> String {
        let row = |i: u32| format!("{date} 10:00:{:02}.{:03}{end};1\n", i / 50, 20 * (i % 50));
        format!("Zeit;a\n{}", (0..40).map(row).collect::<String>())
    };
    let first = |text: &str, options: &ReadOptions| names(text, options).1.join("|");
    for (date, end) in [
        ("17.02.2024", ""),
        ("2024.02.17", ""),
        ("17/02/2024", ""),
        ("02/17/2024", " AM"),
        ("17-02-24", ""),
        ("17.2.2024", ""),
    ] {
        let notes = first(&dated(date, end), &ReadOptions::new());
        assert!(notes.contains("2024-02-17T10:00:00Z"), "{date}: {notes}");
    }
    let notes = first(&dated("02/17/2024", " pm"), &ReadOptions::new());
    assert!(notes.contains("2024-02-17T22:00:00Z"), "{notes}");
    let commas = dated("17.02.2024", "").replace(".0", ",0").replace("17,02", "17.02");
    assert_eq!(names(&commas, &ReadOptions::new()).0, "a");
    // Points between the numbers of a date mean that the day comes first. Slashes leave the order
    // open.
    let notes = first(&dated("05.01.2024", ""), &ReadOptions::new());
    assert!(notes.contains("2024-01-05T10"), "{notes}");
    let open = dated("05/01/2024", "");
    fails(
        &open,
        &ReadOptions::new(),
        &["row 2, column Zeit", "05/01/2024", "--time Zeit:dmy or Zeit:mdy"],
    );
    let said = |order| first(&open, &ReadOptions::new().time("Zeit").date_order(order));
    assert!(said(DateOrder::DayFirst).contains("2024-01-05T10"));
    assert!(said(DateOrder::MonthFirst).contains("2024-05-01T10"));
    // A later row shows the order.
    let midnight = "t;a\n12/11/2024 23:50:00;1\n13/11/2024 00:00:00;1\n13/11/2024 00:10:00;2\n";
    let read = Recording::from_reader(midnight.as_bytes(), "t", &ReadOptions::new()).expect("read");
    assert_eq!(read.trial.time_s, [0.0, 600.0, 1200.0]);
}

#[test]
fn a_name_without_numbers_below_it_is_no_time() {
    let row = |i: u32| format!("{}.5,{i}\n", 100 + i);
    let text = "length_mm,bridge_v,t\n".to_owned() + &(0..40).map(row).collect::<String>();
    fails(&text, &ReadOptions::new(), &["no column time_s", "--time"]);
    let read =
        Recording::from_reader(text.as_bytes(), "t.csv", &ReadOptions::new().sample_rate_hz(50.0));
    let trial = read.expect("a rate was said").trial;
    assert_eq!((trial.rate_hz(), trial.time_s[1]), (Some(50.0), 0.02));
    assert!(RowReader::new(text.as_bytes(), "t.csv", &ReadOptions::new()).is_err());
}

/// A column that is asked for without its unit, or in other case, is found if only one column can be meant, and it keeps
/// its unit. Otherwise the error lists the columns.
#[test]
fn columns_are_found_by_base_name_and_in_other_case() {
    let with_units = format!("Time,Knee Angle,Voltage\ns,deg,V\n{}", rows(",", ""));
    let plain = format!("time_s,knee_angle_deg,voltage_v\n{}", rows(",", ""));
    let [packed, read] = [&with_units, &plain].map(|text| {
        let read = |options: &ReadOptions| {
            let recording = Recording::from_reader(text.as_bytes(), "t.csv", options);
            recording.map(|recording| recording.trial)
        };
        for asked in [["Knee Angle", "Voltage"], ["knee_angle", "VOLTAGE_V"]] {
            let options = asked.iter().fold(ReadOptions::new(), |all, name| all.require(*name));
            let trial = read(&options).unwrap_or_else(|e| panic!("{asked:?}: {e}"));
            let names: Vec<&str> = trial.channels.iter().map(|c| c.name.as_str()).collect();
            assert_eq!(names, ["knee_angle_deg", "voltage_v"], "{asked:?} of {text:.60}");
            for name in asked {
                assert!(trial.require(name).is_ok(), "{name}");
            }
            // A live stream finds the same columns.
            let mut live = RowReader::new(text.as_bytes(), "t.csv", &options).expect("a header");
            let row = live.next_row().expect("a row").expect("numbers");
            assert_eq!(row.values, [100.0, 1.0]);
        }
        (read(&ReadOptions::new().time("TIME")), read(&ReadOptions::new().require("voltage_mv")))
    });
    for (time, other) in [packed, read] {
        assert_eq!(time.expect("a time").len(), 40);
        let error = other.expect_err("another unit").to_string();
        assert!(error.contains("did you mean voltage_v?"), "{error}");
    }
    let two = format!("time_s,force_n,force_kn\n{}", rows(",", ""));
    let asked = ReadOptions::new().require("force");
    let error = Recording::from_reader(two.as_bytes(), "t.csv", &asked).expect_err("two of them");
    assert!(error.to_string().contains("the columns are time_s, force_n, force_kn"), "{error}");
}
