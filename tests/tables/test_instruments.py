"""Files as loggers, scopes, historians and programs write them, the same oven in each: columns, clock, every row."""

from datetime import datetime, timedelta

import numpy as np
import pytest

from driftwise.tables.autoread import read

SAMPLES = 400
RNG = np.random.default_rng(7)
U = np.repeat(RNG.integers(1, 6, SAMPLES // 20), 20) * 10.0
Y = 22 + np.convolve(U, 0.05 * 0.92 ** np.arange(90))[:SAMPLES] + 0.15 * RNG.normal(size=SAMPLES)
ROWS = range(SAMPLES)


def at(k, step):
    return datetime(2024, 3, 14, 9, 26, 53) + timedelta(seconds=step * k)


def comma(value, digits=2):
    return f"{value:.{digits}f}".replace(".", ",")


# lines, (output, inputs, s between rows): what a colleague says who opens the file
WRITTEN = {
    "Campbell TOA5": (
        ['"TOA5","CR1000","CR1000","12345","CR1000.Std.27","CPU:prog.CR1","4123","Table1"',
         '"TIMESTAMP","RECORD","heater_W","Temp_C"', '"TS","RN","W","Deg C"', '"","","Avg","Avg"',
         *(f'"{at(k, 60)}",{k},{U[k]:.1f},{Y[k]:.3f}' for k in ROWS)],
        ("Temp_C", ("heater_W",), 60.0),
    ),
    "HOBO": (
        ['"Plot Title: oven"',
         '"#","Date Time, GMT+01:00","Heater, W (LGR S/N: 1)","Temp, °C (LGR S/N: 1)","Coupler Attached"',
         *(f"{k + 1},{at(k, 60):%m/%d/%y %I:%M:%S %p},{U[k]:.1f},{Y[k]:.3f}," for k in ROWS)],
        ("Temp, °C (LGR S/N: 1)", ("Heater, W (LGR S/N: 1)",), 60.0),
    ),
    "Influx, annotated": (
        ["#group,false,false,false,false,true", "#datatype,string,long,dateTime:RFC3339,double,string",
         "#default,_result,,,,", ",result,table,_time,_value,_field",
         *(f",,0,{at(k, 1):%Y-%m-%dT%H:%M:%SZ},{U[k]:.1f},heater" for k in ROWS),
         *(f",,1,{at(k, 1):%Y-%m-%dT%H:%M:%SZ},{Y[k]:.3f},temperature" for k in ROWS)],
        ("temperature", ("heater",), 1.0),
    ),
    "Home Assistant": (
        ["entity_id,state,last_changed",
         *(f"{name},{value if k % 97 else 'unavailable'},{at(k, 30):%Y-%m-%dT%H:%M:%S.000Z}" for k in ROWS
           for name, value in (("sensor.oven_temperature", f"{Y[k]:.2f}"), ("number.heater_power", f"{U[k]:.0f}")))],
        ("sensor.oven_temperature", ("number.heater_power",), 30.0),
    ),
    "LabVIEW": (
        ["LabVIEW Measurement\t", "Writer_Version\t2", "Separator\tTab", "Decimal_Separator\t.", "Multi_Headings\tNo",
         "X_Columns\tOne", "Date\t2024/03/14", "***End_of_Header***\t", "\t", "Channels\t2\t\t", "Samples\t400\t400\t",
         "Y_Unit_Label\tW\tDeg C\t", "X0\t0\t0\t", "Delta_X\t0.1\t0.1\t", "***End_of_Header***\t\t\t",
         "X_Value\tHeater\tTemperature\tComment", *(f"{k * 0.1:.6f}\t{U[k]:.6f}\t{Y[k]:.6f}" for k in ROWS)],
        ("Temperature", ("Heater",), 0.1),
    ),
    "PicoScope": (
        ["Time,Channel A,Channel B", "(ms),(V),(mV)", "", *(f"{k * 0.5:.8f},{U[k]:.6f},{Y[k]:.6f}" for k in ROWS)],
        ("Channel B", ("Channel A",), 0.0005),
    ),
    "Keysight": (
        ["x-axis,1,2", "second,Volt,Volt", *(f"{k * 1e-4:+.5E},{U[k]:+.4E},{Y[k]:+.4E}" for k in ROWS)],
        ("Volt.2", ("Volt",), 1e-4),
    ),
    "Torque, on board": (
        ["GPS Time, Device Time, Longitude, Latitude,Throttle Position(Manifold)(%),Speed (OBD)(km/h)",
         *(f"Thu Mar 14 {at(k, 1):%H:%M:%S} GMT+01:00 2024,{at(k, 1):%d-%b-%Y %H:%M:%S}.000,8.5,47.3,{U[k]:.2f},"
           f"{Y[k] if k % 50 else '-'}" for k in ROWS)],
        ("Speed (OBD)(km/h)", ("Throttle Position(Manifold)(%)",), 1.0),
    ),
    "ThingSpeak": (
        ["created_at,entry_id,field1,field2,latitude,longitude,elevation,status",
         *(f"{at(k, 15)} UTC,{k + 1},{U[k]:.0f},{Y[k]:.2f},,,," for k in ROWS)],
        ("field2", ("field1",), 15.0),
    ),
    "USGS": (
        ["# Data provisional", "#", "agency_cd\tsite_no\tdatetime\ttz_cd\t69928_00060\t69928_00060_cd\t69929_00065",
         "5s\t15s\t20d\t6s\t14n\t10s\t14n",
         *(f"USGS\t01646500\t{at(k, 900):%Y-%m-%d %H:%M}\tEST\t{U[k]:.0f}\tP\t{Y[k]:.2f}" for k in ROWS)],
        ("69929_00065", ("69928_00060",), 900.0),
    ),
    "Siemens trace": (
        ["sep=;", "Trace;Trace_1", "Sampling;10 ms", 'Index;Time [ms];"Heater".Setpoint;"Oven".ActualTemperature',
         *(f"{k};{k * 10};{comma(U[k])};{comma(Y[k], 4)}" for k in ROWS)],
        ("Oven.ActualTemperature", ("Heater.Setpoint",), 0.01),
    ),
    "Grafana": (
        ['"Time","heater power","oven temperature"', *(f"{at(k, 15)},{U[k]:.0f} W,{Y[k]:.1f} °C" for k in ROWS)],
        ("oven temperature", ("heater power",), 15.0),
    ),
    "Agilent 34970": (
        ["Name:,,Data", "Owner:,,me", "Acquisition Date:,,3/14/2024 9:26:53 AM", "", "Total Channels:,2",
         "Channel,Name,Function,Range,Resolution", "101,Heater,DC volts,auto,5.5", "102,Oven,Temp (Type K),,", "",
         "Scan,Time,101 <Heater> (VDC),Alarm 101,102 <Oven> (C),Alarm 102",
         *(f"{k + 1},{at(k, 10):%m/%d/%Y %H:%M:%S}:000,{U[k]:.6e},0,{Y[k]:.6e},0" for k in ROWS)],
        ("102 <Oven> (C)", ("101 <Heater> (VDC)",), 10.0),
    ),
    "Logger Pro": (
        ["Vernier Format 2", "oven.cmbl 3/14/2024 09:26:53 .", "Run 1", "Time\tHeater\tTemperature", "t\tP\tT",
         "s\tW\t°C", "", *(f"{k * 0.5:g}\t{U[k]:g}\t{Y[k]:.4f}" for k in ROWS)],
        ("Temperature T", ("Heater P",), 0.5),
    ),
    "ROS bag": (
        ["time,.header.seq,.header.stamp.secs,.header.frame_id,.effort,.velocity",
         *(f"{at(k, 0.02):%Y/%m/%d/%H:%M:%S.%f},{k},{1710408413 + k // 50},base,{U[k]:.4f},{Y[k]:.5f}" for k in ROWS)],
        (".velocity", (".effort",), 0.02),
    ),
    "write.table": (
        ['"date" "heater" "temp"', *(f'"{k + 1}" "{at(k, 86400):%Y-%m-%d}" {U[k]:.1f} {Y[k]:.3f}' for k in ROWS)],
        ("temp", ("heater",), 86400.0),
    ),
    "thousands": (
        ["Date,Heater [W],Pressure [Pa]",
         *(f'{at(k, 3600):%d/%m/%Y %H:%M},"{U[k] * 100:,.0f}","{Y[k] * 5000:,.0f}"' for k in ROWS)],
        ("Pressure [Pa]", ("Heater [W]",), 3600.0),
    ),
    "markdown": (
        ["| time | heater | temperature |", "|---|---|---|", *(f"| {k} | {U[k]:.1f} | {Y[k]:.3f} |" for k in ROWS)],
        ("temperature", ("heater",), 1.0),
    ),
    "a PLC's minutes": (
        ["Zeit;Heizung;Temperatur", "[mm:ss];[W];[°C]",
         *(f"{k // 60:02d}:{k % 60:02d};{U[k]:.0f};{comma(Y[k])}" for k in ROWS)],
        ("Temperatur", ("Heizung",), 1.0),
    ),
    "a serial monitor": (
        [f"Heater: {U[k]:.0f}, Temp: {Y[k]:.2f}" for k in ROWS],
        ("Temp", ("Heater",), 1.0),
    ),
    "a log of names and values": (
        [f"ts={at(k, 5).isoformat()}Z level=info heater={U[k]:.1f} temperature={Y[k]:.3f}" for k in ROWS],
        ("temperature", ("heater",), 5.0),
    ),
    "Blackbox": (
        ['"Product","Blackbox flight data recorder"', '"Data version",2', '"looptime",125',
         "loopIteration,time (us), setpoint[0], gyroADC[0]",
         *(f"{k * 4}, {5_000_000 + k * 500}, {U[k]:.0f}, {10 * Y[k]:.0f}" for k in ROWS)],
        ("gyroADC[0]", ("setpoint[0]",), 0.0005),
    ),
}  # fmt: skip


@pytest.mark.parametrize("program", WRITTEN)
def test_what_a_program_writes_is_read_as_a_colleague_would(tmp_path, program):
    lines, (output, inputs, dt) = WRITTEN[program]
    (path := tmp_path / "oven.csv").write_text("\n".join(lines) + "\n")
    table, segments = read(path)
    assert (table.output, table.inputs) == (output, inputs) and table.dt == pytest.approx(dt, rel=1e-6)
    y = np.concatenate([piece[1] for piece in segments])
    assert len(y) == SAMPLES and np.isnan(y).sum() <= 10
