//! Runs the same observer in two forms: from volts in `f32`, and from converter codes in integers, as on a board
//! without a floating-point unit. The integer form is stored as a binary calibration file and loaded again, as from an
//! EEPROM. A sinusoidal voltage drives both forms.
//!
//! ```text
//! cargo run --release -p stretch-receptor --example volts_and_codes
//! ```

use stretch_core::{Runner, Volts, record};
use stretch_receptor::{
    Receptor, ReceptorError,
    code::{Adc, AdcCode, AdcSpec, FixedObserver},
    example_observer,
};

const FULL_SCALE_V: f64 = 3.3;

fn main() -> Result<(), ReceptorError> {
    let calibration = example_observer();
    let mut from_volts = Runner::new(Receptor::<f32>::new(&calibration)?);

    let adc = Adc::new(AdcSpec { bits: 12, zero_v: 0.0, full_scale_v: FULL_SCALE_V })?;
    let mut eeprom = [0xff_u8; 1024];
    let bytes = record::store(&FixedObserver::new(&calibration, &adc)?, &mut eeprom)?.len();
    println!("The binary calibration file of integers has {bytes} bytes.");
    let loaded: FixedObserver = record::load(&eeprom[..bytes])?;
    let mut from_codes = Runner::new(loaded);

    println!("time_s,bridge_v,adc_code,length_mm,length_um");
    let mut largest_mm = 0.0_f32;
    for n in 0..500_u16 {
        let time_s = f64::from(n) / 100.0;
        let code = (1650.0 + 200.0 * (2.0 * time_s).sin()).round() as i32;
        let bridge_v = f64::from(code) * FULL_SCALE_V / 4095.0;
        let (volts, codes) =
            (from_volts.step(Volts(bridge_v as f32)), from_codes.step(AdcCode(code)));
        let (Ok(volts), Ok(codes)) = (volts, codes) else { continue };
        largest_mm = largest_mm.max((volts.estimate - codes.estimate as f32 / 1000.0).abs());
        if n % 50 == 49 {
            println!("{time_s:.2},{bridge_v:.4},{code},{:.3},{}", volts.estimate, codes.estimate);
        }
    }
    println!("Largest difference between the two: {largest_mm:.4} mm.");
    assert!(largest_mm < 0.05, "the integers follow the floating-point form");
    Ok(())
}
