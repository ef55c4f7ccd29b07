//! The frame `05 06 83 FF FF 4E FF 27`, and its first bytes, in every way that anything prints them.

use super::*;

const FRAME: [u8; 8] = [0x05, 0x06, 0x83, 0xFF, 0xFF, 0x4E, 0xFF, 0x27];

#[test]
fn groups() {
    for text in [
        "05 01 8a",
        "05018A",
        "0501 8A",
        " 05\t01  8a \r",
        "0x05 0x01 0x8A",
        "0X05,0x01, 0x8a,",
        "0x05018A",
        "05:01:8A",
        "05-01-8a",
        "05\u{2010}01\u{2013}8A",
        "05\u{2212}01\u{2212}8A",
        "05.01.8A",
        "05_01_8A",
        "05;01;8A",
        "05; 01; 8A;",
        "05|01|8A",
        "| 05 | 01 | 8A |",
        "05·01·8A",
        "05:01-8A",
        "[05][01][8A]",
        "[05 01 8A]",
        "[05, 01, 8A]",
        "<05><01><8a>",
        "<05 01 8A>",
        "(05)(01)(8A)",
        "{05}{01}{8A}",
        "{0x05, 0x01, 0x8A}",
        "{ 0x05, 0x01, 0x8A, };",
        "'05' '01' '8A'",
        "'05','01','8A'",
        "\"05 01 8A\"",
        "'05018A'",
        "`05 01 8A`",
        "“05 01 8A”",
        "‘05’ ‘01’ ‘8A’",
        r"\x05\x01\x8A",
        r"\x05 \x01 \x8A",
        r"\X05,\X01,\X8A",
        "$05 $01 $8A",
        "$05,$01,$8a",
        "$05018A",
        "#05 #01 #8A",
        "#05018A",
        "%05%01%8A",
        "&H05 &H01 &H8A",
        "&h05, &h01, &h8a",
        "16#05 16#01 16#8A",
        "16#05, 16#01, 16#8A",
        "B#16#05, B#16#01, B#16#8A",
        "8'h05, 8'h01, 8'h8A",
        "24'h05018A",
        "&#x05;&#x01;&#x8A;",
        "05h 01h 8Ah",
        "05H,01H,8AH",
        "05h01h8ah",
        "05018Ah",
        "x'05018A'",
        "X'05 01 8A'",
        "0x05u 0x01U 0x8Au8",
        "0x05_01_8A",
        "\u{FEFF}05 01 8A",
        "\u{FEFF}05:01:8A",
        "05\u{A0}01\u{A0}8A",
        "05\u{2009}01\u{202F}8A",
        "05\u{200B}01\u{FEFF}8A",
        "05\u{3000}01\u{2028}8A",
        "05\n01\r\n8A\n",
        "05\u{B}01\u{C}8A",
    ] {
        assert_eq!(parse(text.as_bytes()).expect(text), [0x05, 0x01, 0x8A], "{text}");
    }
    let all: Vec<u8> = (0..=255).collect();
    assert_eq!(parse(show(&all).as_bytes()).unwrap(), all);
    assert_eq!(parse(show(&all).to_lowercase().as_bytes()).unwrap(), all);
    for (before, between, behind) in [
        ("", ":", ""),
        ("", "-", ""),
        ("[", "][", "]"),
        ("\\x", "\\x", ""),
        ("", "h, ", "h"),
        ("0x", ",0x", ","),
    ] {
        let text = format!("{before}{}{behind}", show(&all).replace(' ', between));
        assert_eq!(parse(text.as_bytes()).expect(&text), all);
    }
}

#[test]
fn source_code() {
    for text in [
        "uint8_t frame[] = {0x05, 0x06, 0x83, 0xFF, 0xFF, 0x4E, 0xFF, 0x27};",
        "static const unsigned char pkt1[8] = {\n0x05, 0x06, 0x83, 0xff, /* .... */\n0xff, 0x4e, 0xff, 0x27  /* .N.' */\n};",
        "const uint8_t a[8] = { 0x05, 0x06, // head\n 0x83, 0xFF, 0xFF, 0x4E, 0xFF, 0x27 };",
        "byte[] frame = {0x05, 0x06, (byte)0x83, (byte)0xFF, (byte) 0xff, 0x4E, (byte)0xFF, 0x27};",
        "new byte[] {0x05, 0x06, 0x83, 0xFF, 0xFF, 0x4E, 0xFF, 0x27}",
        "[]byte{0x05, 0x06, 0x83, 0xff, 0xff, 0x4e, 0xff, 0x27}",
        "let frame = [0x05u8, 0x06, 0x83, 0xFF, 0xFF, 0x4E, 0xFF, 0x27];",
        "&[0x05, 0x06, 0x83, 0xFF, 0xFF, 0x4E, 0xFF, 0x27]",
        "vec![0x05, 0x06, 0x83, 0xFF, 0xFF, 0x4E, 0xFF, 0x27]",
        "bytes([0x05, 0x06, 0x83, 0xFF, 0xFF, 0x4E, 0xFF, 0x27])",
        "bytes.fromhex('05 06 83 FF FF 4E FF 27')",
        "bytes.fromhex(\"050683ffff4eff27\")",
        "Buffer.from([0x05, 0x06, 0x83, 0xFF, 0xFF, 0x4E, 0xFF, 0x27])",
        "new Uint8Array([0x05, 0x06, 0x83, 0xFF, 0xFF, 0x4E, 0xFF, 0x27])",
        "frame = 05 06 83 FF FF 4E FF 27",
        r#"b"\x05\x06\x83\xff\xffN\xff'""#,
        r#"B'\x05\x06\x83\xFF\xFFN\xFF\''"#,
        r#"bytearray(b"\x05\x06\x83\xff\xffN\xff'")"#,
        r#""\x05\x06\x83\xff\xff\x4e\xff\x27""#,
        r#""\x05\x06\x83" "\xff\xff\x4e\xff\x27""#,
        r#""\x05\x06\x83\xff"
           "\xffN\xff'";"#,
        r#"frame = b"\x05\x06\x83\xff\xffN\xff'""#,
        r"'\x05', '\x06', '\x83', '\xff', '\xff', '\x4E', '\xff', '\x27'",
        r"b\x05\x06\x83\xff\xff\x4e\xff\x27",
        "0x05uy; 0x06uy; 0x83uy; 0xFFuy; 0xFFuy; 0x4Euy; 0xFFuy; 0x27uy",
    ] {
        assert_eq!(parse(text.as_bytes()).unwrap_or_else(|bad| panic!("{text}: {bad:?}")), FRAME, "{text}");
    }
    assert_eq!(parse(br"b'\x05A\n\r\t\\\0 \''").unwrap(), b"\x05A\n\r\t\\\0 '");
}

#[test]
fn dumps() {
    for text in [
        "00000000: 0506 83ff ff4e ff27                      .....N.'",
        "00000000: 0506 83ff ff4e ff27  .....N.'",
        "00000000: 050683ff ff4eff27                    .....N.'",
        "00000000: 05 06 83 ff ff 4e ff 27  .....N.'",
        "00000020: 0506 83ff ff4e ff27",
        "0000: 05 06 83 FF FF 4E FF 27",
        "\t0x0000:  0506 83ff ff4e ff27                      .....N.'",
        "00000000  05 06 83 ff ff 4e ff 27                           |.....N.'|",
        "00000000  05 06 83 ff ff 4e ff 27                           |.....N.'|\n00000008",
        "00000020  05 06 83 ff ff 4e ff 27                           |.....N.'|",
        "0000   05 06 83 ff ff 4e ff 27                           .....N.'",
        "0000   05 06 83 ff ff 4e ff 27",
        "0000000 05 06 83 ff ff 4e ff 27\n0000010\n",
        "0000000 05 06 83 ff ff 4e ff 27                          >.....N.'<",
        "00000000   05 06 83 FF FF 4E FF 27                          ..ƒÿÿNÿ'",
        "05 06 83 ff ff 4e ff 27   .....N.'",
        "00000000: 0506 83ff  ....\n00000004: ff4e ff27  .N.'\n",
        "00000000  05 06 83 ff  |....|\n00000004  ff 4e ff 27  |.N.'|\n00000008\n",
        "0000000 05 06 83 ff\n0000004 ff 4e ff 27\n0000010\n",
        "can0  123   [8]  05 06 83 FF FF 4E FF 27",
        "  vcan0  1F334455   [8]  05 06 83 FF FF 4E FF 27   '.....N.''",
        "(1436509052.249713) can0 123#050683FFFF4EFF27",
    ] {
        assert_eq!(parse(text.as_bytes()).unwrap_or_else(|bad| panic!("{text}: {bad:?}")), FRAME, "{text}");
    }
    // 16 and more, the second line after the first.
    let bytes: Vec<u8> = (0..20).collect();
    let text = "00000000  00 01 02 03 04 05 06 07  08 09 0a 0b 0c 0d 0e 0f  |................|\n\
                00000010  10 11 12 13                                       |....|\n00000014";
    assert_eq!(parse(text.as_bytes()).unwrap(), bytes);
    let text = "0000000 00 01 02 03 04 05 06 07 08 09 0a 0b 0c 0d 0e 0f\n0000020 10 11 12 13\n0000024";
    assert_eq!(parse(text.as_bytes()).unwrap(), bytes);
}

#[test]
fn what_is_not_bytes_is_refused_with_its_place() {
    for (text, kind, position) in [
        ("05 1 80", "odd_digits", Some("4")),
        ("05 0x", "odd_digits", Some("4")),
        ("05 0x1", "odd_digits", Some("6")),
        ("05 0G", "not_hex", Some("5")),
        ("0x0x05", "not_hex", Some("4")),
        ("\u{b0}5", "not_hex", Some("1")),
        ("", "empty", None),
        (" , ", "empty", None),
        ("[]", "empty", None),
        ("\u{FEFF}", "empty", None),
        ("\u{FEFF}05 0G", "not_hex", Some("5")),
        // Something is missing.
        ("05,,06", "missing", Some("4")),
        ("05::06", "missing", Some("4")),
        ("05 - - 06", "missing", Some("6")),
        ("05-", "not_hex", Some("3")),
        ("[05 06", "unclosed", Some("1")),
        ("05 06]", "not_hex", Some("6")),
        ("\"05 06", "unclosed", Some("1")),
        ("(05]", "not_hex", Some("4")),
        (r"b'\x05", "unclosed", Some("2")),
        (r"'\x05\x0", "odd_digits", Some("6")),
        ("05…27", "not_hex", Some("3")),
        ("05 06 ...", "missing", Some("8")),
        // Other things than bytes in hexadecimal.
        (":0506", "not_hex", Some("1")),
        ("-05", "not_hex", Some("1")),
        ("05/06", "not_hex", Some("3")),
        ("05+06", "not_hex", Some("3")),
        ("RX: 05 06", "not_hex", Some("1")),
        ("05 06 ok", "not_hex", Some("7")),
        ("frame 05 06", "not_hex", Some("1")),
        ("[5, 6, 131]", "odd_digits", Some("2")),
        (r"\005\006", "not_hex", Some("1")),
        (r"\u0005", "not_hex", Some("1")),
        (r"\x5", "odd_digits", Some("3")),
        ("05h6", "odd_digits", Some("4")),
        ("05x", "not_hex", Some("3")),
        ("0x05h", "not_hex", Some("5")),
        ("0o05", "not_hex", Some("2")),
        ("０５", "not_hex", Some("1")),
        // A letter between quotes is a byte in one language and a digit in another.
        (r"'\x05', 'N'", "not_hex", Some("10")),
        // What can be read in two ways.
        ("0b00000101", "ambiguous", Some("1")),
        ("05 0B10000011", "ambiguous", Some("4")),
        (r"\x05A", "ambiguous", Some("5")),
        ("b'0506'", "ambiguous", Some("2")),
        (r#""\\x05""#, "ambiguous", Some("2")),
        ("0000 05 06 83", "ambiguous", Some("1")),
        ("0000000 0605 ff83 4eff 27ff", "ambiguous", Some("9")),
        ("00000000: 0506 8", "ambiguous", Some("11")),
        ("00000000: 05 06\n00000003: 83", "offset", Some("17")),
        ("00000000  05 06  |..|\n00000010  83  |.|", "offset", Some("23")),
    ] {
        let error = match parse(text.as_bytes()) {
            Ok(bytes) => panic!("{text}: {bytes:02X?}"),
            Err(bad) => serde_json::to_value(bad).unwrap(),
        };
        assert_eq!(error["error"]["kind"], kind, "{text}: {error}");
        let found = error["error"].get("position").map(ToString::to_string);
        assert_eq!(found.as_deref(), position, "{text}: {error}");
    }
}

/// Every beginning of a good text, and every text with a character changed, is bytes or an error with a place.
#[test]
fn damaged() {
    let texts = [
        "uint8_t a[2] = {0x05, (byte)0x83};",
        r#"bytearray(b"\x05N\xff'")"#,
        "00000000  05 06 83  |...|\n00000003",
        "can0  123   [2]  05 06",
        "16#05, 8'h06, &H83, $FF, 05h",
    ];
    for text in texts {
        let text: Vec<char> = text.chars().collect();
        for at in 0..text.len() {
            _ = parse(text[..at].iter().collect::<String>().as_bytes());
            for other in "05gxh:-.,;|#$%&'\"\\[](){}<> \n\u{FEFF}é".chars() {
                let mut changed = text.clone();
                changed[at] = other;
                if let Err(bad) = parse(changed.iter().collect::<String>().as_bytes()) {
                    let error = serde_json::to_value(bad).unwrap();
                    let place = error["error"]["position"].as_u64();
                    assert!(error["error"]["kind"] == "empty" || place.is_some_and(|at| at > 0));
                }
            }
        }
    }
}
