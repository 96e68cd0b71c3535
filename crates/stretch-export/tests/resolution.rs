//! Tests of the resolution of estimates in integers, and of sample periods.

use stretch_calibrate::{CalibrateError, fixed_record, parse_adc, read_calibration};
use stretch_core::{
    Calibration, CalibrationSpec, Degree, Label, Model, SampleRate, Surface, Target,
};
use stretch_export::{ExportError, Form, Options, arduino_library, header};
use stretch_receptor::example_observer;

fn options(form: Option<Form>) -> Options {
    Options { form, adc: parse_adc("12,0,3.3").unwrap() }
}

fn changed(calibration: Calibration, change: impl FnOnce(&mut CalibrationSpec)) -> Calibration {
    let mut spec = calibration.into_spec();
    change(&mut spec);
    Calibration::new(spec).unwrap()
}

/// A calibration of every model with an integer form, for a length in millimetres.
fn in_millimetres() -> impl Iterator<Item = Calibration> {
    ["linear", "poly13", "observer", "observer-rest"].into_iter().map(|name| {
        let root = env!("CARGO_MANIFEST_DIR");
        read_calibration(format!("{root}/../../firmware/data/{name}.postcard").as_ref()).unwrap()
    })
}

fn in_metres(calibration: Calibration) -> Calibration {
    changed(calibration, |spec| {
        let Target::Contraction { rest_length } = spec.target else { panic!("a length") };
        spec.reference = Label::new("length_m").unwrap();
        spec.target = Target::Contraction { rest_length: rest_length / 1000.0 };
    })
}

#[test]
fn integers_state_their_step_and_are_refused_where_it_exceeds_the_error_of_the_fit() {
    for calibration in in_millimetres() {
        let fixed = header(&calibration, &options(Some(Form::Fixed))).unwrap();
        assert_eq!(fixed.step.as_deref(), Some("0.001 mm"), "{}", fixed.model);
        assert!(fixed.text.contains("Estimates have steps of 0.001 mm."), "{}", fixed.text);

        let metres = in_metres(calibration);
        let error = header(&metres, &options(Some(Form::Fixed))).unwrap_err().to_string();
        for part in ["length_m", "steps of 0.001", "mm instead of m", "--form float"] {
            assert!(error.contains(part), "{part}: {error}");
        }
        let error = fixed_record(&metres, &options(None).adc).unwrap_err();
        assert!(matches!(error, CalibrateError::NoFixedForm(_)), "{error}");
        // if no form is requested, the form with enough resolution is chosen
        let float = header(&metres, &options(None)).unwrap();
        assert_eq!((float.form, float.step), (Form::Float, None));
        for part in ["the form is float, because", "steps of 0.001", "not a code of the converter"]
        {
            assert!(float.notes[0].contains(part), "{part}: {:?}", float.notes);
        }
        assert!(fixed.notes.is_empty() && fixed.text.contains("#define STRETCH_LAST_CODE"));
        for code in ["STRETCH_LAST_CODE", "STRETCH_LOWEST_CODE", "STRETCH_HIGHEST_CODE"] {
            assert!(!float.text.contains(code), "a program for codes compiles in float");
        }
        assert!(float.text.contains("A step takes the signal, not a code: STRETCH_ADC_ZERO"));
    }
}

/// In integers a curve would wait for the window of a rate that it does not use.
#[test]
fn a_curve_of_any_degree_is_exported_in_float_under_its_name() {
    for coefficients in [[0.02, 0.8, 0.3].as_slice(), &[0.02, 0.8, 0.3, -0.1, 0.05, -0.04]] {
        let calibration = changed(in_millimetres().nth(1).unwrap(), |spec| {
            let Model::Surfaces { inflation, deflation } = &mut spec.model else {
                panic!("poly13")
            };
            let degree = Degree::new(0, coefficients.len() as u8 - 1).unwrap();
            inflation.surface = Surface::new(degree, coefficients).unwrap();
            *deflation = *inflation;
        });
        let error = header(&calibration, &options(Some(Form::Fixed))).unwrap_err().to_string();
        for part in ["the curve model has no integer form", "--form float"] {
            assert!(error.contains(part), "{part}: {error}");
        }
        let float = header(&calibration, &options(None)).unwrap();
        assert_eq!((float.form, float.model.as_str()), (Form::Float, "curve"));
        assert!(float.notes[0].contains("because the curve model has no"), "{:?}", float.notes);
    }
}

#[test]
fn a_reference_beyond_32_bits_is_exported_in_float() {
    let calibration = changed(in_millimetres().next().unwrap(), |spec| {
        spec.reference = Label::new("force_n").unwrap();
        spec.target = Target::Contraction { rest_length: 2.95e6 };
    });
    let error = header(&calibration, &options(Some(Form::Fixed))).unwrap_err().to_string();
    for part in ["force_n", "kN instead of N", "--form float"] {
        assert!(error.contains(part), "{part}: {error}");
    }
    assert_eq!(header(&calibration, &options(None)).unwrap().form, Form::Float);
}

#[test]
fn a_period_is_never_stated_as_zero() -> Result<(), ExportError> {
    for (hz, ns, us) in
        [(100.0, 10_000_000, Some(10_000)), (1e3, 1_000_000, Some(1000)), (3e6, 333, None)]
    {
        let at_rate = changed(example_observer(), |spec| {
            spec.sample_rate_hz = SampleRate::new(hz).unwrap();
        });
        let made = header(&at_rate, &options(Some(Form::Float)))?;
        assert!(made.text.contains(&format!("#define STRETCH_PERIOD_NS INT64_C({ns}) ")), "{hz}");
        match us {
            Some(us) => {
                assert!(made.text.contains(&format!("#define STRETCH_PERIOD_US {us}L ")), "{hz}")
            }
            None => assert!(!made.text.contains("STRETCH_PERIOD_US"), "{hz}"),
        }
        let library = arduino_library(&made, "Elbow")?;
        let live = library.iter().find(|file| file.path.ends_with(".ino")).unwrap();
        assert!(live.text.contains("#if !defined(STRETCH_PERIOD_US)\n#error"), "{hz}");
    }
    Ok(())
}
