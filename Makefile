# Everything here is also a plain command; see README.md and CONTRIBUTING.md.
PYTHON ?= .venv/bin/python

.PHONY: demo test full lint docs release share screenshots format accuracy bench bench-real batch same-bytes tables study hidden metamorphic refusals inserted-blocks \
	goldens goldens-update planted fuzz fuzz-core mutation ci clean

demo:            ## fix the shipped five-axis example
	./try

test:            ## set up and run the tests
	./try test

full:            ## the tests with grids of cases and random programs whole, where a usual run takes a fifth or so (an hour)
	NCFIX_FULL=1 ./try test

lint:            ## style, types, floors (needs: pip install -e '.[dev]')
	$(PYTHON) -m ruff check .
	$(PYTHON) -m ruff format --check .
	$(PYTHON) -m mypy
	$(dir $(PYTHON))lint-imports

share:           ## write the manual page and the completion scripts into share/
	$(PYTHON) -c "from pathlib import Path; from ncfix.cli.manual import shared_files as s; [((p := Path('share', f)).parent.mkdir(parents=True, exist_ok=True), p.write_text(t)) for f, t in s()]"

docs:            ## the site of all documents, strictly, into build/site (needs: pip install -e '.[docs]')
	NO_MKDOCS_2_WARNING=1 $(PYTHON) -m mkdocs build --strict -q

release:         ## wheel, sdist, bill of materials (CycloneDX) and hashes into dist/ (needs: pip install -e '.[release]')
	rm -rf dist
	NCFIX_BUILD=$(or $(NCFIX_BUILD),require) $(PYTHON) release.py dist

screenshots:     ## take the pictures of pages in docs/figures/ (needs chromium)
	NCFIX_REQUIRE_TOOLS=1 NCFIX_SCREENSHOTS=docs/figures $(PYTHON) -m pytest -q tests/report

format:
	$(PYTHON) -m ruff format .
	$(PYTHON) -m ruff check --fix .

accuracy:        ## work out docs/accuracy.md (an hour), or STUDIES="plans ..." of it
	OMP_NUM_THREADS=1 $(PYTHON) tests/validation/accuracy.py $(STUDIES)

bench:           ## time ncfix, rs274 and Lark in turn, into docs/performance.md; SIZES="1000000" RUNS=5 LONG=10000000 OTHERS=200000 VERBS="100000 1000000"
	OMP_NUM_THREADS=1 $(PYTHON) benchmarks/run.py $(if $(filter-out undefined,$(origin SIZES)),--sizes $(SIZES)) $(if $(RUNS),--runs $(RUNS)) $(if $(LONG),--long $(LONG)) $(if $(OTHERS),--others $(OTHERS)) $(if $(filter-out undefined,$(origin VERBS)),--verbs $(VERBS))

bench-real:      ## time ncfix and rs274 on the largest real programs of the corpus, into docs/performance.md; COUNT=20 RUNS=3
	OMP_NUM_THREADS=1 $(PYTHON) benchmarks/real_programs.py $(if $(COUNT),--count $(COUNT)) $(if $(RUNS),--runs $(RUNS))

batch:           ## time batches, again and on a cluster, into docs/performance.md (minutes); PROGRAMS=2000 KILLS=20 workers of the cluster
	OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(PYTHON) benchmarks/batch.py $(if $(PROGRAMS),--programs $(PROGRAMS)) $(if $(KILLS),--kills $(KILLS))

same-bytes:      ## correct programs in all ways, compare, into docs/performance.md (an hour; MOST=20000 ten minutes)
	OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(PYTHON) benchmarks/same_bytes.py $(if $(MOST),--most $(MOST))

tables:          ## all controls on all shipped machines into docs/controllers.md (ten minutes)
	OMP_NUM_THREADS=1 $(PYTHON) tests/tables/all_controls.py

study:           ## the diagnosis on worlds of its own and other values of its constants into docs/accuracy.md (an hour); SCENES="single=40 two=20" AGAIN=6
	PYTHONPATH=src:plugins:tests OMP_NUM_THREADS=1 $(PYTHON) tests/diagnose/study.py --table docs/accuracy.md --from 24 \
		$(or $(SCENES),clean=10 clutter=20 single=30 thermal=20 curves=20 weak=20 two=20 three=15 deleted=20 foreign=20)
	PYTHONPATH=src:plugins:tests OMP_NUM_THREADS=1 $(PYTHON) tests/diagnose/calibration.py $(or $(AGAIN),6) --from 30 --table docs/accuracy.md

hidden:          ## the hidden-effect benchmark into docs/accuracy.md (two hours); FINAL=1 for the final seeds, COUNT="10 single=40"
	$(PYTHON) -m tests.hidden --callable tests.diagnose.resident:resident --table docs/accuracy.md \
		$(if $(FINAL),--final) $(foreach count,$(COUNT),--count $(count)) $(if $(RECORDS),--records $(RECORDS))

metamorphic:     ## 500 pairs of programs for each relation, into docs/accuracy.md (an hour); PAIRS=50 DIALECTS="siemens or haas"
	NCFIX_PAIRS=$(or $(PAIRS),500) NCFIX_TABLE=docs/accuracy.md OMP_NUM_THREADS=1 $(PYTHON) -m pytest -q \
		tests/metamorphic $(if $(DIALECTS),-k "$(DIALECTS)")

refusals:        ## what becomes of the motion blocks of the corpus, all folders, also flat (half an hour)
	NCFIX_CORPUS=1 OMP_NUM_THREADS=1 $(PYTHON) -m pytest -q tests/classes/test_accounting.py tests/classes/test_siemens_account.py

inserted-blocks: ## how many blocks a correction puts into the programs of the corpus, by language (minutes); TOLERANCE=1.9 MOST=20000
	OMP_NUM_THREADS=1 $(PYTHON) benchmarks/inserted_blocks.py $(if $(TOLERANCE),--tolerance-um $(TOLERANCE)) $(if $(MOST),--most $(MOST))

GOLDENS = PYTHONPATH=tests OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(PYTHON) -m goldens $(ONLY) \
	$(if $(JOBS),--jobs $(JOBS)) $(if $(AGAINST),--against $(AGAINST)) $(if $(SHOW),--show $(SHOW))

goldens:         ## compare what comes out with docs/changes-of-output.md; ONLY="klartext measure" AGAINST=COMMIT JOBS=2 SHOW=CASE
	$(GOLDENS)

goldens-update:  ## take what comes out now as right; ONLY="klartext"
	$(GOLDENS) --update

planted:         ## 1,000 faults in corrected programs and 1,000 good ones, judged by the second reader (minutes); COUNT=100
	PYTHONPATH=tests OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(PYTHON) -m certificate.planting \
		--programs $(or $(COUNT),1000) --faults $(or $(COUNT),1000)

fuzz:            ## damaged files for all readers; what goes wrong is kept in tests/robustness/found; SECONDS=600 ONLY=machine
	PYTHONPATH=tests OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(PYTHON) -m robustness.readers \
		--seconds $(or $(SECONDS),600) $(if $(ONLY),--only $(ONLY))

mutation:        ## faults put into the code of writer, limits, account, control, numbers and core, and which of them tests find (needs: pip install -e '.[mutation]'); COUNT=60 of each ONLY=limits SEED=1
	PYTHONPATH=tests OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(PYTHON) -m robustness.mutation \
		--count $(or $(COUNT),60) $(if $(ONLY),--only '$(ONLY)') $(if $(SEED),--seed $(SEED))

fuzz-core:       ## the compiled core under sanitizers, fed with damaged programs (needs gcc's libasan); SECONDS=600 SEED=7
	$(PYTHON) tests/core/fuzz.py --seconds $(or $(SECONDS),600) $(if $(SEED),--seed $(SEED))

ci:              ## what the server runs
	.ci/run

clean:
	rm -rf .venv build dist out .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
