MODULE pallet
  PERS tooldata RmpTool:=[TRUE,[[0,0,0],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];
  PERS wobjdata RmpFrame:=[FALSE,TRUE,"",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
  VAR pose cell;
  VAR num r;
  VAR num c;
  VAR num l;
  VAR num count;

  PROC main()
    ConfJ\Off;
    ConfL\Off;
    cell:=[[0,0,0],[1,0,0,0]];
    r:=0;
    c:=0;
    l:=0;
    count:=0;
    FOR i_l FROM 0 TO 1 STEP 1 DO
      l:=i_l;
      FOR i_r FROM 0 TO 2 STEP 1 DO
        r:=i_r;
        FOR i_c FROM 0 TO 3 STEP 1 DO
          c:=i_c;
          IF RmpMod(r, 2)=0 THEN
            cell:=PoseMult([[700,-200,20],[0.965925826,0,0,0.258819045]],[[110*c,85*r,60*l],[1,0,0,0]]);
          ELSE
            cell:=PoseMult([[700,-200,20],[0.965925826,0,0,0.258819045]],[[110*(3-c),85*r,60*l],[1,0,0,0]]);
          ENDIF
          MoveJ RmpTarget([[300,450,150],[0,0,1,0]]),[5000,500,5000,1000],fine,RmpTool\WObj:=RmpFrame;
          SetDO do3,1;
          MoveJ RmpTarget(PoseMult(PoseMult(cell,[[0,0,120],[1,0,0,0]]),[[0,0,0],[0,0,1,0]])),[5000,500,5000,1000],[FALSE,100,150,150,15,150,15],RmpTool\WObj:=RmpFrame;
          MoveL RmpTarget(PoseMult(cell,[[0,0,0],[0,0,1,0]])),[150,90,5000,1000],fine,RmpTool\WObj:=RmpFrame;
          SetDO do3,0;
          MoveL RmpTarget(PoseMult(PoseMult(cell,[[0,0,120],[1,0,0,0]]),[[0,0,0],[0,0,1,0]])),[500,90,5000,1000],fine,RmpTool\WObj:=RmpFrame;
          count:=count+1;
        ENDFOR
      ENDFOR
    ENDFOR
    TEST count
    CASE 24:
      TPWrite "full";
    CASE 0,1:
      TPWrite "empty";
    DEFAULT:
      EXIT;
    ENDTEST
  ENDPROC

  LOCAL FUNC robtarget RmpTarget(pose p)
    VAR robtarget t;
    t:=CRobT(\Tool:=RmpTool\WObj:=RmpFrame);
    t.trans:=p.trans;
    t.rot:=p.rot;
    RETURN t;
  ENDFUNC

  LOCAL FUNC num RmpTrunc(num x)
    IF x<0 RETURN -Trunc(-x);
    RETURN Trunc(x);
  ENDFUNC

  LOCAL FUNC num RmpMod(num a,num b)
    RETURN a-b*RmpTrunc(a/b);
  ENDFUNC
ENDMODULE
