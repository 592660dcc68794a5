MODULE towers
  RECORD PEG
    num height;
    pos foot;
  ENDRECORD
  PERS tooldata RmpTool:=[TRUE,[[0,0,0],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];
  PERS wobjdata RmpFrame:=[FALSE,TRUE,"",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
  VAR PEG pegs{3};
  VAR num transfers;

  PROC main()
    ConfJ\Off;
    ConfL\Off;
    pegs{1}.height:=0;
    pegs{1}.foot:=[600,-250,0];
    pegs{2}.height:=0;
    pegs{2}.foot:=[600,0,0];
    pegs{3}.height:=0;
    pegs{3}.foot:=[600,250,0];
    transfers:=0;
    pegs{1}.height:=3;
    solve 3,1,3,2;
    IF transfers<>7 OR pegs{3}.height<>3 THEN
      TPWrite "wrong: "+ValToStr(transfers);
      EXIT;
    ENDIF
    TPWrite "done in "+ValToStr(transfers)+" transfers";
  ENDPROC

  FUNC pose spot(num peg2,num z2)
    RETURN [[pegs{peg2}.foot.x,pegs{peg2}.foot.y,pegs{peg2}.foot.z+z2],[0,0,1,0]];
  ENDFUNC

  PROC grip(num state)
    IF state=1 THEN
      SetDO do3,1;
    ELSE
      SetDO do3,0;
    ENDIF
    WaitTime 0.3;
  ENDPROC

  PROC transfer(num a,num b)
    VAR num za;
    VAR num zb;
    za:=0;
    zb:=0;
    za:=30*(pegs{a}.height-1)+15;
    zb:=30*pegs{b}.height+15;
    MoveJ RmpTarget(spot(a,260)),[5000,500,5000,1000],fine,RmpTool\WObj:=RmpFrame;
    MoveL RmpTarget(spot(a,za)),[100,90,5000,1000],fine,RmpTool\WObj:=RmpFrame;
    grip 1;
    MoveL RmpTarget(spot(a,260)),[250,90,5000,1000],fine,RmpTool\WObj:=RmpFrame;
    MoveJ RmpTarget(spot(b,260)),[5000,500,5000,1000],fine,RmpTool\WObj:=RmpFrame;
    MoveL RmpTarget(spot(b,zb)),[100,90,5000,1000],fine,RmpTool\WObj:=RmpFrame;
    grip 0;
    MoveL RmpTarget(spot(b,260)),[250,90,5000,1000],fine,RmpTool\WObj:=RmpFrame;
    pegs{a}.height:=pegs{a}.height-1;
    pegs{b}.height:=pegs{b}.height+1;
    transfers:=transfers+1;
  ENDPROC

  PROC solve(num n,num from2,num target,num spare)
    IF n=0 THEN
      RETURN;
    ENDIF
    solve n-1,from2,spare,target;
    transfer from2,target;
    solve n-1,spare,target,from2;
  ENDPROC

  LOCAL FUNC robtarget RmpTarget(pose p)
    VAR robtarget t;
    t:=CRobT(\Tool:=RmpTool\WObj:=RmpFrame);
    t.trans:=p.trans;
    t.rot:=p.rot;
    RETURN t;
  ENDFUNC
ENDMODULE
