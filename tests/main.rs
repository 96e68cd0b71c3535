//! Integration tests of the program in one test program, because linking takes longer than most of
//! the tests.

mod attack;
mod compare;
mod corpus;
mod demo;
mod diagnose;
mod diagnose_gauge;
mod diagnosed;
mod every_effect;
mod export;
mod fix;
mod fixed_record;
mod golden_records;
mod listen;
mod newcomer;
mod own_data;
mod page;
mod pages;
mod problem;
mod program;
mod shifts;
mod simulate;
mod sleeve;
mod static_sensor;
mod support;
mod terminal;
