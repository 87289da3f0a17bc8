function serve()
% Runs functions of a folder on numbers in files, for whoever started it: a file 'ask' a run, an answer a line. The
% standard input is of no use: fgetl waits there for what comes behind a line.
page_screen_output(false);
asker = getppid();
waited = 0;
while waited < 600 && getppid() == asker
    if ~exist('ask', 'file')
        nap = min(0.002 + waited / 20, 0.1);  % asked again and again at first, seldom once nobody asks
        pause(nap);
        waited = waited + nap;
        continue
    end
    words = strsplit(strtrim(fileread('ask')), ' ');
    delete('ask');
    waited = 0;
    try
        counts = cellfun(@str2double, words(3:5));
        addpath(words{1});
        file = fopen(fullfile(words{1}, 'in'), 'r', 'l');
        u = fread(file, [counts(2), counts(1)], 'double').';
        begun = {};
        if counts(3) >= 0
            begun = {fread(file, counts(3), 'double')};
        end
        fclose(file);
        [y, state, flags] = feval(words{2}, u, begun{:});
        file = fopen(fullfile(words{1}, 'out'), 'w', 'l');
        fwrite(file, y.', 'double');
        fwrite(file, state, 'double');
        fwrite(file, flags, 'double');
        fclose(file);
        answer = 'done';
    catch problem
        answer = strrep(problem.message, "\n", ' ');
    end
    rmpath(words{1});
    printf("%s\n", answer);
    fflush(stdout);
end
end
