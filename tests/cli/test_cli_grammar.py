import pytest


def test_list_names_the_papers_grammars(gecar):
    found = gecar("grammar", "list", "--json").json["grammars"]
    assert {"paper", "table1"} <= set(found)
    assert found["paper"]["robot_language"]
    assert not found["table1"]["robot_language"]


def test_derive_shows_table_2(gecar):
    ended = gecar("grammar", "derive", "table1", "302122", "--json")
    assert ended.json["phenotype"] == "x*x"
    steps = ended.json["steps"]
    assert [(s["codon"], s["choices"], s["chosen"]) for s in steps if s["codon"] is not None] == [
        (3, 3, 0), (0, 3, 0), (2, 3, 2), (1, 3, 1), (2, 4, 2), (2, 3, 2),
    ]  # fmt: skip
    assert "x*<code>" in ended.err


def test_derive_says_where_the_codons_ran_out(gecar):
    ended = gecar("grammar", "derive", "table1", "3 0")
    assert ended.code == 0
    assert "Invalid: the codons ran out at <code><code><code>" in ended.out


def test_derive_draws_a_tree_and_says_where(gecar, tmp_path):
    ended = gecar("grammar", "derive", "table1", "302122", "--picture", tmp_path / "tree.png")
    assert f"Picture: {tmp_path}/tree.png" in ended.out
    assert (tmp_path / "tree.png").stat().st_size > 1_000


def test_map_gives_programs_as_people_read_them(gecar):
    ended = gecar("grammar", "map", "paper", "1,18,10,5")
    assert "motor(80,0,50)" in ended.out
    assert "1 of 1 genomes are valid" in ended.out


def test_map_of_random_genomes_depends_on_the_seed_alone(gecar):
    first, again, other = (gecar("grammar", "map", "paper", "--seed", seed).out for seed in (1, 1, 2))
    assert first == again != other


def test_check_warns_of_what_nothing_reaches(gecar, tmp_path):
    (tmp_path / "odd.bnf").write_text("<a> ::= x\n<b> ::= y\n")
    ended = gecar("grammar", "check", "odd.bnf")
    assert ended.code == 0
    assert "line 2: <b> cannot be reached" in ended.out


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (("check", "nowhere.bnf"), "nowhere.bnf"),
        (("derive", "paper", "1,256"), "256"),
        (("derive", "paper", "1,x"), "'x'"),
        (("derive", "paper", ""), "codons"),
        (("derive", "table1", "30", "--picture", "x.png"), "a derivation that finishes"),
        (("derive", "table1", "302122", "--picture", "x.gif"), ".png"),
        (("map", "paper", "--count", "0"), "--count"),
        (("map", "paper", "--seed", "-1"), "--seed"),
        (("map", "paper", "1", "--wraps", "-1"), "wraps"),
    ],
)
def test_bad_input_is_one_line(gecar, words, named):
    assert named in gecar.error("grammar", *words)
