//! Board-specific code, to be replaced when porting to another board.

use core::marker::PhantomData;

use embedded_hal_02::adc::{Channel, OneShot};
use stretch_receptor::code::AdcCode;

use crate::trial;

/// A converter that takes one sample per call.
///
/// embedded-hal 1.0 has no trait for converters. The crates of most chips still implement the trait of embedded-hal 0.2
/// ([`OneShot`]), and [`Pin`] adapts it. If the crate of your chip does not implement [`OneShot`], implement this trait
/// directly.
pub trait Converter {
    /// Error if there is no sample.
    type Error;

    /// Starts a conversion and waits for it: a few microseconds.
    fn convert(&mut self) -> Result<AdcCode, Self::Error>;
}

/// A converter of embedded-hal 0.2, and the pin to which the bridge's amplifier is connected.
pub struct Pin<Port, Adc, P> {
    adc: Adc,
    pin: P,
    port: PhantomData<Port>,
}

impl<Port, Adc, P> Pin<Port, Adc, P> {
    /// Combines a converter with one of its pins.
    pub fn new(adc: Adc, pin: P) -> Self {
        Self { adc, pin, port: PhantomData }
    }
}

impl<Port, Adc, P> Converter for Pin<Port, Adc, P>
where
    P: Channel<Port>,
    Adc: OneShot<Port, u16, P>,
{
    type Error = Adc::Error;

    fn convert(&mut self) -> Result<AdcCode, Self::Error> {
        nb::block!(self.adc.read(&mut self.pin)).map(|code| AdcCode(code.into()))
    }
}

/// A replacement for a converter: replays the recorded trial.
pub struct Replay<I>(I);

/// The error after the end of the trial.
pub struct Ended;

impl Replay<()> {
    /// Starts at the first sample.
    pub fn new() -> Replay<impl Iterator<Item = AdcCode>> {
        Replay(trial::codes())
    }
}

impl<I: Iterator<Item = AdcCode>> Converter for Replay<I> {
    type Error = Ended;

    fn convert(&mut self) -> Result<AdcCode, Ended> {
        self.0.next().ok_or(Ended)
    }
}

/// The serial port of Arm's MPS2 boards (CMSDK UART 0), which QEMU emulates.
pub struct Uart(());

impl Uart {
    const BASE: usize = 0x4000_4000;

    /// Enables the transmitter.
    ///
    /// # Safety
    /// The program must run on an MPS2 board, and nothing else may use the port.
    pub unsafe fn take() -> Self {
        let uart = Self(());
        uart.write_register(0x10, 217); // 25 MHz / 115,200
        uart.write_register(0x08, 1);
        uart
    }

    fn write_register(&self, offset: usize, value: u32) {
        // SAFETY: the register belongs to the port, whose exclusive use the caller of `take`
        // guarantees.
        unsafe { ((Self::BASE + offset) as *mut u32).write_volatile(value) }
    }

    fn full(&self) -> bool {
        // SAFETY: as above.
        unsafe { ((Self::BASE + 0x04) as *const u32).read_volatile() & 1 != 0 }
    }
}

impl embedded_io::ErrorType for Uart {
    type Error = core::convert::Infallible;
}

impl embedded_io::Write for Uart {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Self::Error> {
        for &byte in bytes {
            while self.full() {}
            self.write_register(0, byte.into());
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<(), Self::Error> {
        Ok(())
    }
}
